# cython: boundscheck=False, wraparound=False, embedsignature=True
"""Binding of the C core: arrays in, arrays out, the GIL released while it runs."""

from libc.math cimport cos, sin
from libc.stdint cimport int8_t, int32_t, int64_t, uint8_t
from libc.stdlib cimport free, malloc

import numpy as np

cdef extern from "capsule.h" nogil:
    ctypedef struct capsule_parameters:
        double alpha, omega, delta, zeta, beta, gamma, f_b
    ctypedef struct capsule_constants:
        double kappa, omega, delta, zeta, friction, drift
    ctypedef struct capsule_start:
        double x_r, gap, v_r, v_c, margin, cos_theta, sin_theta
    ctypedef struct capsule_map:
        capsule_constants field[6]
    void capsule_flow(const capsule_constants *, const capsule_start *, double, double *)
    double capsule_flow_advance(const capsule_constants *, const capsule_start *, double, double)
    void capsule_jacobian(const capsule_constants *, const capsule_start *, double, double *)
    double capsule_margin_at(const capsule_constants *, double, double, double)
    ctypedef struct capsule_state:
        double x_r, gap, v_r, v_c, angle, angle_rest, position
        int64_t turn
        int32_t bound, plane
    ctypedef struct capsule_segment:
        pass
    ctypedef struct capsule_event:
        int32_t field, plane
    ctypedef struct capsule_wish:
        double (*strobe)[3]
        capsule_segment *segments
        capsule_event *events
        size_t room
        int position
    ctypedef struct capsule_motion:
        int32_t switches
    ctypedef int capsule_outcome
    ctypedef int capsule_stop
    void capsule_map_make(const capsule_parameters *, capsule_map *)
    void capsule_map_remake(const capsule_parameters *, capsule_map *)
    capsule_state capsule_state_at(const capsule_map *, double, double, double, double)
    capsule_stop capsule_run(const capsule_map *, capsule_state *, int64_t, const capsule_wish *,
                             size_t *, capsule_outcome *)
    capsule_stop capsule_steady(const capsule_map *, const capsule_state *, double (*)[3], int, double,
                                capsule_event *, size_t, capsule_motion *, capsule_outcome *)
    ctypedef struct capsule_many:
        size_t stride
        const capsule_parameters *parameters
        capsule_state *states
        int8_t *stops
        double (*strobe)[3]
        int position
    ctypedef struct capsule_crew:
        pass
    void capsule_run_many(const capsule_many *, size_t, int64_t, capsule_crew *)
    const char *capsule_digest()

OUTCOMES = ("regular", "graze", "corner", "sliding-tangency", "never", "undecided", "end")
DONE, FULL, OPEN = range(3)

STATE = np.dtype(
    [(name, "f8") for name in ("x_r", "gap", "v_r", "v_c", "angle", "angle_rest", "position")]
    + [("turn", "i8"), ("bound", "i4"), ("plane", "i4")],
    align=True,
)
SEGMENT = np.dtype(
    [("start_turn", "i8"), ("end_turn", "i8"), ("start_angle", "f8"), ("end_angle", "f8")]
    + [("start", "f8", 3), ("end", "f8", 3), ("duration", "f8"), ("position", "f8")]
    + [(name, "f8") for name in ("advance", "gap", "margin", "cosine", "sine")]
    + [(name, "i4") for name in ("field", "source", "target", "outcome", "evaluations")],
    align=True,
)
EVENT = np.dtype(
    [("turn", "i8"), ("angle", "f8"), ("field", "i4"), ("plane", "i4")], align=True
)
MOTION = np.dtype(
    [("advance", "f8")] + [(name, "i4") for name in ("multiple", "switches", "field", "never")],
    align=True,
)
assert STATE.itemsize == sizeof(capsule_state)
assert SEGMENT.itemsize == sizeof(capsule_segment)
assert EVENT.itemsize == sizeof(capsule_event)
assert MOTION.itemsize == sizeof(capsule_motion)


def digest():
    """Digest of the generator's inputs that the kernels were made from."""
    return capsule_digest().decode()


cdef void _closed_form(const capsule_constants *c, const capsule_start *start, double h,
                       double *values, double *rows) noexcept nogil:
    values[2] = values[3] = 0.0
    capsule_flow(c, start, h, values)
    if c.drift != 0.0:
        values[3] = capsule_flow_advance(c, start, values[0], h)
    capsule_jacobian(c, start, h, rows)


cdef class Map:
    """The map at one parameter set, seven numbers in the order of `Parameters`."""

    cdef capsule_map *map

    def __cinit__(self, const double[::1] parameters):
        if parameters.shape[0] != 7:
            raise ValueError("seven parameters are needed")
        self.map = <capsule_map *> malloc(sizeof(capsule_map))
        if self.map is NULL:
            raise MemoryError()
        capsule_map_make(<const capsule_parameters *> &parameters[0], self.map)

    def __dealloc__(self):
        free(self.map)

    def remake(self, double alpha, double omega, double delta, double zeta, double beta,
               double gamma, double f_b):
        """Makes this the map at other parameters; quick where omega, zeta, beta, gamma stay."""
        cdef capsule_parameters parameters = [alpha, omega, delta, zeta, beta, gamma, f_b]
        capsule_map_remake(&parameters, self.map)

    def state_at(self, double x_r, double v_r, double v_c, double phase):
        """The state record to start from, at a time in the excitation period."""
        out = np.empty((), STATE)
        cdef char[::1] view = out.reshape(1).view("i1")
        (<capsule_state *> &view[0])[0] = capsule_state_at(self.map, x_r, v_r, v_c, phase)
        return out

    def final(self, double x_r, double v_r, double v_c, double phase, int64_t periods):
        """(x_r, v_r, v_c) after `periods` excitation periods, None where a switch stays open."""
        cdef capsule_state state
        cdef capsule_wish wish
        cdef size_t written
        cdef capsule_outcome open_
        cdef capsule_stop stop
        wish.strobe = NULL
        wish.segments = NULL
        wish.events = NULL
        wish.room = 0
        wish.position = False
        with nogil:
            state = capsule_state_at(self.map, x_r, v_r, v_c, phase)
            stop = capsule_run(self.map, &state, periods, &wish, &written, &open_)
        return (state.x_r, state.v_r, state.v_c) if stop == 0 else None

    def closed_form(self, int field, const double[::1] start, double h):
        """Values (4,) and Jacobian (4, 12) of one segment's closed form a duration h after start.

        `start` holds x_r, gap, v_r, v_c, margin, cosine and sine of the angle. The values are
        the change of x_r, v_r, the change of v_c, and x_c's advance; the Jacobian has their rows
        and the columns of the generated `jacobian`. At rest the last two of each are zero.
        """
        if not 1 <= field <= 6 or start.shape[0] != 7:
            raise ValueError("field must be 1 to 6, and start seven numbers")
        values, rows = np.zeros(4), np.zeros((4, 12))
        cdef double[::1] out = values
        cdef double[:, ::1] slopes = rows
        _closed_form(&self.map.field[field - 1], <const capsule_start *> &start[0], h, &out[0],
                     &slopes[0, 0])
        return values, rows

    def chain(self, const int32_t[::1] fields, const double[::1] state, double angle,
              const double[::1] durations):
        """Segments one after another, n of them, by the closed form and without any search.

        Starts off from (x_r, v_r, v_c) at a forcing angle, every segment where the last one ends,
        its gap and margin computed from the state. Returns states (n + 1, 3), x_c's advances (n,)
        and Jacobians (n, 4, 12) as `closed_form` gives them; at rest v_c stays what it was.
        """
        cdef Py_ssize_t i, count = fields.shape[0]
        if durations.shape[0] != count or state.shape[0] != 3:
            raise ValueError("one duration a field, and three numbers of state, are needed")
        for i in range(count):
            if not 1 <= fields[i] <= 6:
                raise ValueError("fields must be 1 to 6")
        states, advances = np.empty((count + 1, 3)), np.zeros(count)
        jacobians = np.zeros((count, 4, 12))
        cdef double[:, ::1] at = states
        cdef double[::1] advance = advances
        cdef double[:, :, ::1] slopes = jacobians
        cdef double values[4]
        cdef const capsule_constants *c
        cdef capsule_start start
        at[0, 0], at[0, 1], at[0, 2] = state[0], state[1], state[2]
        with nogil:
            for i in range(count):
                c = &self.map.field[fields[i] - 1]
                start.x_r, start.v_r, start.v_c = at[i, 0], at[i, 1], at[i, 2]
                start.gap = start.x_r - c.delta
                start.margin = capsule_margin_at(c, start.x_r, start.gap, start.v_r)
                start.cos_theta, start.sin_theta = cos(angle), sin(angle)
                _closed_form(c, &start, durations[i], values, &slopes[i, 0, 0])
                at[i + 1, 0] = start.x_r + values[0]
                at[i + 1, 1] = values[1]
                at[i + 1, 2] = start.v_c + values[2]
                advance[i] = values[3]
                angle = angle + c.omega * durations[i]
        return states, advances, jacobians

    def run(self, state, int64_t periods, segments=None, events=None, strobe=None,
            bint position=False):
        """Goes on until period `periods` is over; what is asked for is written to given arrays.

        `state` is a record of STATE, left where the run came to; `segments` or `events` are
        arrays of their dtypes; `strobe` has shape (periods + 1, 3). Returns why it stopped, how
        many segments or events it wrote, and the outcome that stayed open.
        """
        cdef char[::1] at = state.reshape(1).view("i1")
        cdef char[::1] bytes_
        cdef double[:, ::1] marks
        cdef capsule_wish wish
        cdef size_t written = 0
        cdef capsule_outcome open_ = 0
        cdef capsule_stop stop
        wish.strobe = NULL
        wish.segments = NULL
        wish.events = NULL
        wish.room = 0
        wish.position = position
        if state.dtype != STATE:
            raise TypeError("state must be of dtype STATE")
        if strobe is not None:
            marks = strobe
            if marks.shape[0] <= periods or marks.shape[1] != 3:
                raise ValueError("strobe must have shape (periods + 1, 3)")
            wish.strobe = <double (*)[3]> &marks[0, 0]
        if segments is not None:
            if segments.dtype != SEGMENT or not len(segments):
                raise TypeError("segments must be of dtype SEGMENT, and not empty")
            bytes_ = segments.view("i1")
            wish.segments = <capsule_segment *> &bytes_[0]
            wish.room = len(segments)
        elif events is not None:
            if events.dtype != EVENT or not len(events):
                raise TypeError("events must be of dtype EVENT, and not empty")
            bytes_ = events.view("i1")
            wish.events = <capsule_event *> &bytes_[0]
            wish.room = len(events)
        with nogil:
            stop = capsule_run(self.map, <capsule_state *> &at[0], periods, &wish, &written,
                               &open_)
        return stop, written, OUTCOMES[open_]


def start_many(const double[:, ::1] parameters, const double[:, ::1] starts,
               const double[::1] phases, states):
    """Writes the state records that the runs start from, one per row of the others."""
    cdef char[::1] at = states.view("i1")
    cdef capsule_state *records = <capsule_state *> &at[0]
    cdef Py_ssize_t i, count = len(states)
    cdef capsule_map *work = <capsule_map *> malloc(sizeof(capsule_map))
    if work is NULL:
        raise MemoryError()
    with nogil:
        for i in range(count):
            if i == 0:
                capsule_map_make(<const capsule_parameters *> &parameters[i, 0], work)
            else:
                capsule_map_remake(<const capsule_parameters *> &parameters[i, 0], work)
            records[i] = capsule_state_at(work, starts[i, 0], starts[i, 1], starts[i, 2],
                                          phases[i])
    free(work)


def run_many(const double[:, ::1] parameters, states, int64_t periods, int8_t[::1] stops,
             double[:, :, ::1] strobe=None, bint position=False, size_t stride=1):
    """Runs every row, or every so many, to the end of period `periods`, leaving in `states` where it came to.

    `stops` receives why each run stopped; `strobe`, shape (rows, periods + 1, 3), the states at
    the ends of the periods.
    """
    cdef char[::1] at = states.view("i1")
    cdef size_t count = len(states)
    cdef capsule_many many
    cdef capsule_crew *crew = <capsule_crew *> malloc(sizeof(capsule_crew))
    if crew is NULL:
        raise MemoryError()
    many.stride = stride
    many.parameters = <const capsule_parameters *> &parameters[0, 0]
    many.states = <capsule_state *> &at[0]
    many.stops = &stops[0]
    many.strobe = NULL if strobe is None else <double (*)[3]> &strobe[0, 0, 0]
    many.position = position
    with nogil:
        capsule_run_many(&many, count, periods, crew)
    free(crew)


def steady_many(const double[:, ::1] parameters, states, double[:, :, ::1] strobe,
                double tolerance, int8_t[::1] stops, motions, uint8_t[:, ::1] switches):
    """Finds the motion that every finished row is in, one whose stop is DONE.

    `states` holds where runs came to, at the end of a period, and row i of `strobe` the state
    before the last periods and those at their ends, as `run_many` writes them. `stops` receives
    why the search stopped, `motions` (of MOTION) what was found. Row i of `switches` receives one
    byte 16 field + plane for every switch of a period of the motion, from the end of the run on;
    a motion with more switches than half the row holds stops at FULL.
    """
    cdef char[::1] at = states.view("i1")
    cdef char[::1] to = motions.view("i1")
    cdef capsule_state *records = <capsule_state *> &at[0]
    cdef capsule_motion *found = <capsule_motion *> &to[0]
    cdef Py_ssize_t i, k, count = len(states)
    cdef bint made = False
    cdef int periods = strobe.shape[1] - 1
    cdef size_t room = switches.shape[1]
    cdef capsule_outcome open_
    cdef capsule_map *work = <capsule_map *> malloc(sizeof(capsule_map))
    cdef capsule_event *events = <capsule_event *> malloc(room * sizeof(capsule_event))
    if work is NULL or events is NULL:
        free(work)
        free(events)
        raise MemoryError()
    with nogil:
        for i in range(count):
            if stops[i] != 0:
                continue
            if not made:
                made = True
                capsule_map_make(<const capsule_parameters *> &parameters[i, 0], work)
            else:
                capsule_map_remake(<const capsule_parameters *> &parameters[i, 0], work)
            stops[i] = <int8_t> capsule_steady(work, &records[i], <double (*)[3]> &strobe[i, 1, 0],
                                               periods, tolerance, events, room, &found[i], &open_)
            for k in range(found[i].switches):
                switches[i, k] = <uint8_t> (16 * events[k].field + events[k].plane)
    free(work)
    free(events)
