# cython: boundscheck=False, wraparound=False, cdivision=True, embedsignature=True
"""Binding of the C core: arrays in, arrays out, without the GIL while it runs.

Long work stops at Ctrl-C, with the exception of its handler, and at a `Watch`.
"""

import threading
from time import perf_counter

from libc.math cimport INFINITY, NAN, cos, fabs, sin
from libc.stdint cimport int8_t, int32_t, int64_t, uint8_t
from libc.stdlib cimport calloc, free, malloc
from libc.string cimport memset

import numpy as np

from capsule_sym.generated import interface

from . import facts

records = interface.records(facts)

include "capsule_interface.pxi"

cdef extern from "capsule.h":
    int CAPSULE_UNKNOWNS(int count)
    int CAPSULE_COLUMNS(int count)
    size_t CAPSULE_SYSTEM_ROOM(size_t count)
    size_t CAPSULE_ITINERARY_ROOM(size_t count)

cdef extern from *:
    """
    #include <time.h>
    static double now(void) /* in seconds, of a clock that nobody sets */
    {
        struct timespec t;
    #ifdef _WIN32
        timespec_get(&t, TIME_UTC);
    #else
        clock_gettime(CLOCK_MONOTONIC, &t);
    #endif
        return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
    }
    """
    double now() noexcept nogil
    int PyErr_CheckSignals() noexcept

OUTCOMES = interface.OUTCOMES
DONE, FULL, OPEN, STOPPED, REFUSED = map(int, interface.Stop)
cdef int _DONE = DONE, _FULL = FULL, _OPEN = OPEN, _REFUSED = REFUSED
ROWS = 8192  # least rows of a strobe whose rows are reused

def digest():
    """Digest of the generator's inputs from which the kernels were made."""
    return capsule_digest().decode()


def lanes():
    """Number of runs side by side on this processor: 8 (AVX-512), 4 (AVX2) or 1."""
    return capsule_lanes()


def widths():
    """Numbers of lanes that may be requested for runs, besides one."""
    return tuple(width for width in (4, 8) if width <= capsule_widest())


ctypedef struct attention:
    capsule_watch watch
    int *flag
    double deadline, looked
    bint signals, raised, stopped


# The main thread alone handles signals, which needs the GIL; others may hold it.
cdef int _ask(void *about) noexcept nogil:
    cdef attention *a = <attention *> about
    cdef double time = now()
    if a.stopped or time > a.deadline:
        a.stopped = True
    elif a.flag is not NULL and (<const volatile int *> a.flag)[0]:
        a.stopped = True
    elif a.signals and not (0.0 <= time - a.looked < 0.01):
        a.looked = time
        with gil:
            if PyErr_CheckSignals() != 0:
                a.raised = a.stopped = True
    return a.stopped


cdef capsule_watch *_attend(attention *a, watch, int[::1] flag):
    a.watch.ask = _ask
    a.watch.about = a
    a.watch.most = a.watch.done = a.watch.work = 0
    a.flag = NULL if watch is None else &flag[0]
    # The clock is read last here, so that the watch is over too when this limit stops the work.
    cdef double left = INFINITY if watch is None else watch.deadline - perf_counter()
    a.deadline = now() + left
    a.looked = now()
    a.signals = threading.current_thread() is threading.main_thread()
    a.raised = a.stopped = False
    return &a.watch


cdef enum:
    PIECE = 512  # segments written at a time: a run that pauses resumes within a rounding
    MOST_EXTREMA = 2048  # of a quantity in a segment
    MAP_WORK = 32  # work of making a map, in expansions


cdef int _raised(attention *a) except -1:
    """Re-raise the exception of a signal's handler."""
    return -1 if a.raised else 0


cdef void _closed_form(const capsule_constants *c, const capsule_start *start, double h,
                       double *values, double *rows) noexcept nogil:
    values[2] = values[3] = 0.0
    capsule_flow(c, start, h, values)
    if c.drift != 0.0:
        values[3] = capsule_flow_advance(c, start, values[0], h)
    capsule_jacobian(c, start, h, rows)


cdef object _part(object block, const double *begin, const double *at, Py_ssize_t rows,
                  Py_ssize_t columns):
    cdef Py_ssize_t first = at - begin
    return block[first : first + rows * columns].reshape(rows, columns)


cdef object _arrays(object block, const capsule_system *system, int count):
    """Arrays of a system, laid out in a block."""
    cdef double[::1] numbers = block
    cdef const double *begin = &numbers[0]
    cdef Py_ssize_t unknowns = CAPSULE_UNKNOWNS(count), columns = CAPSULE_COLUMNS(count)
    states_by = _part(block, begin, system.states_by, count + 1, CAPSULE_STATE_COUNT * columns)
    return (
        block[: system.residual - begin].view(SEGMENT_FLOW),
        states_by.reshape(count + 1, CAPSULE_STATE_COUNT, columns),
        block[system.residual - begin : system.residual - begin + unknowns],
        _part(block, begin, system.by, unknowns, columns),
        block[system.advance_by - begin : system.advance_by - begin + columns],
        system.advance,
        _part(block, begin, system.monodromy, CAPSULE_STATE_COUNT, CAPSULE_STATE_COUNT),
    )


cdef class Fields:
    """Closed forms of the fields at one parameter set, numbers in the order of `Parameters`."""

    cdef capsule_map *map

    def __cinit__(self, const double[::1] parameters):
        if parameters.shape[0] != CAPSULE_PARAMETER_COUNT:
            raise ValueError(f"{CAPSULE_PARAMETER_COUNT} parameters are needed")
        self.map = <capsule_map *> malloc(sizeof(capsule_map))
        if self.map is NULL:
            raise MemoryError()
        capsule_map_constants(<const capsule_parameters *> &parameters[0], self.map)

    def __dealloc__(self):
        free(self.map)

    def closed_form(self, int field, const double[::1] start, double h):
        """Values (4,) and Jacobian (4, 12) of one segment's closed form a duration h after start.

        `start` holds x_r, gap, v_r, v_c, margin, cosine and sine of the angle. The values are
        the change of x_r, v_r, the change of v_c, and x_c's advance; the Jacobian has their rows
        and the columns of the generated `jacobian`. At rest the last two of each are zero.
        """
        if not 1 <= field <= CAPSULE_FIELD_COUNT or start.shape[0] != 7:
            raise ValueError(f"field must be 1 to {CAPSULE_FIELD_COUNT}, and start seven numbers")
        values, rows = np.zeros(4), np.zeros((4, CAPSULE_COLUMN_COUNT))
        cdef double[::1] out = values
        cdef double[:, ::1] slopes = rows
        _closed_form(&self.map.field[field - 1], <const capsule_start *> &start[0], h, &out[0],
                     &slopes[0, 0])
        return values, rows

    def extrema(self, int field, start, int quantity, int zeros, double duration):
        """Extrema inside a segment, (kind, time, value) each; None if they are undecided.

        `start` is as for `closed_form`, as a tuple; `quantity` is one of `interface.Quantity`. The
        first `zeros` derivatives of its rate vanish at the start.
        """
        cdef capsule_start begin
        cdef capsule_extremum found[MOST_EXTREMA]
        cdef int count
        interface.Quantity(quantity)
        if not 1 <= field <= CAPSULE_FIELD_COUNT or not 0 <= zeros <= 1:
            raise ValueError(f"field must be 1 to {CAPSULE_FIELD_COUNT}, and zeros 0 or 1")
        (begin.x_r, begin.gap, begin.v_r, begin.v_c, begin.margin, begin.cos_theta,
         begin.sin_theta) = start
        with nogil:
            count = capsule_find_extrema(&self.map.field[field - 1], &begin, quantity, zeros, duration,
                                       found, MOST_EXTREMA)
        if count < 0:
            return None
        return [(found[i].kind, found[i].time, found[i].value) for i in range(count)]

    def constants(self, int field):
        """Constants of a field, in the order of the kernels' own."""
        if not 1 <= field <= CAPSULE_FIELD_COUNT:
            raise ValueError(f"field must be 1 to {CAPSULE_FIELD_COUNT}")
        return _constants(&self.map.field[field - 1])

    cdef capsule_itinerary _itinerary(self, const int32_t[::1] fields, int periods, bint mirrored,
                                      Py_ssize_t unknowns) except *:
        cdef capsule_itinerary itinerary
        if fields.shape[0] < 1 or unknowns != CAPSULE_UNKNOWNS(fields.shape[0]):
            raise ValueError("a state, an angle, and one duration a field are needed")
        itinerary.fields, itinerary.count = &fields[0], <int> fields.shape[0]
        itinerary.periods, itinerary.mirrored = periods, mirrored
        return itinerary

    def evaluate_itinerary(self, const int32_t[::1] fields, int periods, bint mirrored,
                           const double[::1] z):
        """Equations of an itinerary at unknowns z: a state, the forcing angle, n durations.

        Returns the segments as records (n,) of SEGMENT_FLOW; derivatives (n + 1, 3, columns) of the
        states at their starts and of the last end; the residual (n + 4,) with its derivatives (n +
        4, columns); those of x_c's advance (columns,); that advance; and the monodromy matrix (3,
        3). Columns are the unknowns and the parameters.
        """
        cdef capsule_itinerary itinerary = self._itinerary(fields, periods, mirrored, z.shape[0])
        block = np.empty(CAPSULE_SYSTEM_ROOM(itinerary.count))
        cdef double[::1] numbers = block
        cdef capsule_system system = capsule_system_in(&numbers[0], itinerary.count)
        if capsule_evaluate_itinerary(&self.map.parameters, &itinerary, &z[0], &system) != DONE:
            raise ValueError(f"no itinerary of fields 1 to {CAPSULE_FIELD_COUNT}, each led to by one guard")
        return _arrays(block, &system, itinerary.count)

    def solve_itinerary(self, const int32_t[::1] fields, int periods, bint mirrored, z,
                        const double[::1] direction=None, int held=0, watch=None):
        """Solve the equations of an itinerary near unknowns z, as `capsule_solve_itinerary` does.

        Returns z, the system as of `evaluate_itinerary`, the status, the steps and the residual of the
        search, and the parameters, which move along `direction` in place of unknown `held`. The
        status and the system are None if the watch stopped it.
        """
        cdef double[::1] at
        z = np.array(z, dtype=float)
        at = z
        cdef capsule_itinerary itinerary = self._itinerary(fields, periods, mirrored, len(z))
        block = np.empty(CAPSULE_SYSTEM_ROOM(itinerary.count))
        room = np.empty(CAPSULE_ITINERARY_ROOM(itinerary.count))
        cdef double[::1] numbers = block, workspace = room
        cdef capsule_system system = capsule_system_in(&numbers[0], itinerary.count)
        cdef capsule_itinerary_request request
        cdef capsule_parameters parameters = self.map.parameters
        cdef capsule_solution solution
        cdef capsule_stop stop
        cdef attention a
        request.workspace, request.held = &workspace[0], held
        request.direction = NULL
        if direction is not None:
            _need(direction.shape[0] == CAPSULE_PARAMETER_COUNT, "direction", (CAPSULE_PARAMETER_COUNT,))
            request.direction = &direction[0]
        request.watch = _attend(&a, watch, None if watch is None else watch.flag)
        with nogil:
            stop = capsule_solve_itinerary(&itinerary, &request, &parameters, &at[0], &system,
                                           &solution)
        _raised(&a)
        if stop == REFUSED:
            raise ValueError(f"no itinerary of fields 1 to {CAPSULE_FIELD_COUNT}, or no parameters")
        values = tuple((<double *> &parameters)[i] for i in range(CAPSULE_PARAMETER_COUNT))
        arrays = _arrays(block, &system, itinerary.count) if stop == DONE else None
        status = solution.status if stop == DONE else None
        return z, arrays, status, solution.steps, solution.residual, values


cdef class Map(Fields):
    """Map at one parameter set, numbers in the order of `Parameters`."""

    cdef capsule_segment *piece

    def __cinit__(self, const double[::1] parameters):
        capsule_map_make(<const capsule_parameters *> &parameters[0], self.map)

    def __dealloc__(self):
        free(self.piece)

    def remake(self, *values):
        """Make this the map at other parameters; quick if those of the flow are unchanged."""
        cdef capsule_parameters parameters
        cdef int i
        if len(values) != CAPSULE_PARAMETER_COUNT:
            raise ValueError(f"{CAPSULE_PARAMETER_COUNT} parameters are needed")
        for i in range(CAPSULE_PARAMETER_COUNT):
            (<double *> &parameters)[i] = values[i]
        capsule_map_remake(&parameters, self.map)

    def state_at(self, double x_r, double v_r, double v_c, double phase):
        """State record of a start, at a time in the excitation period."""
        out = np.empty((), STATE)
        cdef signed char[::1] view = out.reshape(1).view("i1")
        (<capsule_state *> &view[0])[0] = capsule_state_at(self.map, x_r, v_r, v_c, phase)
        return out

    def end_of_run(self, double x_r, double v_r, double v_c, double phase, int64_t periods,
                   int precision):
        """End of a run, by `run` in pieces of records that are counted and not kept.

        Returns (x_r, v_r, v_c), x_c, whole periods and angle, and the numbers of segments,
        evaluations and segments in 106 bits; None if a switch is undecided.
        """
        cdef attention a
        cdef capsule_state state
        cdef capsule_request request
        cdef size_t written, i
        cdef int64_t segments = 0, evaluations = 0, wide = 0
        cdef capsule_outcome open_
        cdef capsule_stop stop
        if self.piece is NULL:
            self.piece = <capsule_segment *> malloc(PIECE * sizeof(capsule_segment))
            if self.piece is NULL:
                raise MemoryError()
        memset(&request, 0, sizeof(request))
        request.watch = _attend(&a, None, None)
        request.segments, request.room, request.precision = self.piece, PIECE, precision
        with nogil:
            state = capsule_state_at(self.map, x_r, v_r, v_c, phase)
            while True:
                stop = capsule_run(self.map, &state, periods, &request, &written, &open_)
                segments += <int64_t> written
                for i in range(written):
                    evaluations += self.piece[i].evaluations
                    wide += self.piece[i].wide
                if stop != _FULL:
                    break
        _raised(&a)
        if stop == REFUSED:
            raise ValueError(f"no run from {(x_r, v_r, v_c)} at {phase}")
        if stop != _DONE:
            return None
        return ((state.x_r, state.v_r, state.v_c), state.position, state.period, state.angle,
                segments, evaluations, wide)

    def run(self, state, int64_t periods, segments=None, strobe=None, bint position=False,
            watch=None, int precision=0):
        """Continue to the end of period `periods`; requested results are written to given arrays.

        `state` is a record of STATE, replaced by the final one; `segments` is an array of its
        dtype; `strobe` has shape (periods + 1, 3), or fewer rows, at least ROWS: then the state at
        the end of period k is in row k % rows, and the run pauses when half of them are new. For a
        motion that rests forever the last ones are written. Returns the reason to stop, the number
        of segments written, and the outcome that is undecided. `precision` is one of
        `interface.Precision`.
        """
        if state.dtype != STATE:
            raise TypeError("state must be of dtype STATE")
        cdef attention a
        cdef signed char[::1] at = state.reshape(1).view("i1")
        cdef signed char[::1] bytes_
        cdef double[:, ::1] marks
        cdef capsule_request request
        cdef size_t written = 0
        cdef capsule_outcome open_ = 0
        cdef capsule_stop stop
        memset(&request, 0, sizeof(request))
        request.watch = _attend(&a, watch, None if watch is None else watch.flag)
        request.position = position
        request.precision = precision
        if strobe is not None:
            marks = strobe
            if (marks.shape[0] <= periods and marks.shape[0] < ROWS) or marks.shape[1] != 3:
                raise ValueError(f"strobe must have shape (periods + 1, 3), or {ROWS} rows")
            request.rows = marks.shape[0] if marks.shape[0] <= periods else 0
            request.strobe = <double (*)[3]> &marks[0, 0]
        if segments is not None:
            if segments.dtype != SEGMENT or not len(segments):
                raise TypeError("segments must be of dtype SEGMENT, and not empty")
            bytes_ = segments.view("i1")
            request.segments = <capsule_segment *> &bytes_[0]
            request.room = len(segments)
        with nogil:
            stop = capsule_run(self.map, <capsule_state *> &at[0], periods, &request, &written,
                               &open_)
        _raised(&a)
        if stop == REFUSED:
            raise ValueError(f"no run from {state}")
        return stop, written, OUTCOMES[open_]

    def evaluate(self, segments, const double[::1] times, double[:, ::1] states, bint more=False):
        """Write the states (x_r, v_r, v_c, x_c) at absolute times, shape (n, 4).

        `segments` are records of SEGMENT in their order; times that ascend, except for steps back
        over few segments, take least. Before the first segment and after the last the state is that
        of its start or end; with `more` to follow, it ends at the first time after the last one's
        end. Returns the number of states.
        """
        cdef size_t n = times.shape[0], done
        if segments.dtype != SEGMENT:
            raise TypeError("segments must be of dtype SEGMENT")
        _need(<size_t> states.shape[0] == n and states.shape[1] == 4, "states", (n, 4))
        if not n or not len(segments):
            return 0
        cdef attention a
        cdef const signed char[::1] bytes_ = segments.view("i1")
        cdef capsule_watch *watch = _attend(&a, None, None)
        with nogil:
            done = capsule_evaluate(self.map, <const capsule_segment *> &bytes_[0],
                                    <size_t> bytes_.shape[0] // sizeof(capsule_segment), more,
                                    &times[0], n, <double (*)[4]> &states[0, 0], watch)
        _raised(&a)
        if done < n and not more:
            raise ValueError("a field that there is not")
        return done


    def differentiate(self, segments, const double[::1] times, double[:, ::1] switches,
                      double[:, :, ::1] slopes, watch=None):
        """Write the derivatives of switching times (n, 11), and of (x_r, v_r, v_c, x_c) at times.

        Returns the number of segments passed, less than n + 1 if the watch ends it.

        `segments` are all records of a run, n + 1 of them; `times` ascend, and `slopes` has the shape
        (times, 4, 12). The columns are the start's x_r, v_r, v_c and phase, the parameters, and of
        `slopes` the rate of change.
        """
        cdef size_t n = times.shape[0], done
        if segments.dtype != SEGMENT:
            raise TypeError("segments must be of dtype SEGMENT")
        _need(switches.shape[0] + 1 == len(segments) and switches.shape[1] == CAPSULE_SLOPE_COUNT,
              "switches", (len(segments) - 1, CAPSULE_SLOPE_COUNT))
        _need(<size_t> slopes.shape[0] == n and slopes.shape[1] == 4 and
              slopes.shape[2] == CAPSULE_COLUMN_COUNT, "slopes", (n, 4, CAPSULE_COLUMN_COUNT))
        cdef attention a
        cdef capsule_slopes at
        cdef const signed char[::1] bytes_ = segments.view("i1")
        cdef size_t count = len(segments)
        cdef double[CAPSULE_SLOPE_COUNT] *ends = NULL
        cdef double[4][CAPSULE_COLUMN_COUNT] *rows = NULL
        cdef const double *when = NULL
        if count > 1:
            ends = <double[CAPSULE_SLOPE_COUNT] *> &switches[0, 0]
        if n:
            rows, when = <double[4][CAPSULE_COLUMN_COUNT] *> &slopes[0, 0, 0], &times[0]
        cdef capsule_watch *limit = _attend(&a, watch, None if watch is None else watch.flag)
        with nogil:
            capsule_slopes_start(&at)
            done = capsule_differentiate(self.map, <const capsule_segment *> &bytes_[0], count, &at,
                                         ends, when, n, rows, limit)
        _raised(&a)
        if done < count and not a.stopped:
            raise ValueError("a field that there is not")
        return done


cdef int _check_rows(const double[:, ::1] parameters, states) except -1:
    """Refuse arrays that the loops below would overrun: every array has a row for each run."""
    if states.dtype != STATE or states.ndim != 1:
        raise TypeError("states must be of dtype STATE, shape (n,)")
    return _need(parameters.shape[0] == len(states) and
                 parameters.shape[1] == CAPSULE_PARAMETER_COUNT, "parameters",
                 (len(states), CAPSULE_PARAMETER_COUNT))


cdef int _need(bint met, name, shape) except -1:
    if not met:
        raise ValueError(f"{name} must have shape {shape}")
    return 0


def start_many(const double[:, ::1] parameters, const double[:, ::1] starts,
               const double[::1] phases, states, watch=None):
    """Write the state records at the starts of runs, one per row of the others.

    Records that the watch prevents have the gap nan, and no run accepts them.
    """
    cdef Py_ssize_t i, count = len(states)
    _check_rows(parameters, states)
    _need(starts.shape[0] == count and starts.shape[1] == 3, "starts", (count, 3))
    _need(phases.shape[0] == count, "phases", (count,))
    cdef attention a
    cdef signed char[::1] at = states.view("i1")
    cdef capsule_state *records = <capsule_state *> &at[0]
    cdef capsule_map *work = <capsule_map *> malloc(sizeof(capsule_map))
    if work is NULL:
        raise MemoryError()
    _attend(&a, watch, None if watch is None else watch.flag)
    with nogil:
        for i in range(count):
            if a.stopped or capsule_asked(&a.watch, MAP_WORK):
                memset(&records[i], 0, sizeof(capsule_state))
                records[i].x_r, records[i].v_r = starts[i, 0], starts[i, 1]
                records[i].v_c, records[i].gap = starts[i, 2], NAN
                continue
            capsule_map_constants(<const capsule_parameters *> &parameters[i, 0], work)
            records[i] = capsule_state_at(work, starts[i, 0], starts[i, 1], starts[i, 2],
                                          phases[i])
    free(work)
    _raised(&a)


cdef class _Workspace:
    """Workspace of `run_many`, which keeps the tables of the last flows."""

    cdef capsule_workspace *workspace

    def __cinit__(self):
        self.workspace = <capsule_workspace *> calloc(1, sizeof(capsule_workspace))
        if self.workspace is NULL:
            raise MemoryError()

    def __dealloc__(self):
        free(self.workspace)


_kept = threading.local()


def run_many(const double[:, ::1] parameters, states, int64_t periods, int8_t[::1] stops,
             double[:, :, ::1] strobe=None, bint position=False, size_t stride=1, watch=None,
             int lanes=0, int precision=0):
    """Run every row, or every `stride`-th, to the end of period `periods`; states are replaced.

    `stops` receives the result of each run; `strobe`, shape (rows, periods + 1, 3), the states at
    the ends of the periods. Another call resumes runs that the watch stopped. `lanes` is the number
    of runs side by side, 0 for as many as the processor has; `precision` is that of runs outside
    the lanes. Returns the number of undecided runs.
    """
    if stride < 1:
        raise ValueError("stride must be at least 1")
    cdef Py_ssize_t i, left_open = 0, refused = 0, count = len(states)
    _check_rows(parameters, states)
    _need(stops.shape[0] == count, "stops", (count,))
    if strobe is not None:
        _need(strobe.shape[0] == count and strobe.shape[1] == periods + 1 and strobe.shape[2] == 3,
              "strobe", (count, periods + 1, 3))
    cdef attention a
    cdef signed char[::1] at = states.view("i1")
    cdef capsule_batch many
    # Removed while it is used: a signal handler may call this function again.
    cdef _Workspace work = _kept.__dict__.pop("workspace", None) or _Workspace()
    many.stride = stride
    many.parameters = <const capsule_parameters *> &parameters[0, 0]
    many.states = <capsule_state *> &at[0]
    many.stops = &stops[0]
    many.strobe = NULL if strobe is None else <double (*)[3]> &strobe[0, 0, 0]
    many.position = position
    many.lanes = lanes
    many.precision = precision
    many.first = NULL
    many.watch = _attend(&a, watch, None if watch is None else watch.flag)
    with nogil:
        capsule_run_many(&many, count, periods, work.workspace)
        for i from 0 <= i < count by stride:
            left_open += stops[i] == _OPEN
            refused += stops[i] == _REFUSED
    _raised(&a)
    _kept.workspace = work
    if refused:
        raise ValueError("no runs from some of the states")
    return left_open


def first_switches(const double[:, ::1] parameters, states, int64_t periods, events, int lanes):
    """Run every row up to its first switch, `lanes` side by side; `events` (of EVENT) receives it.

    The field of an event is 0 if none came before the end of period `periods`, or if its run is
    undecided, as the returned stops show. A state's `plane` is 0 if lanes found the switch, instead
    of the scalar code.
    """
    if events.dtype != EVENT:
        raise TypeError("events must be of dtype EVENT")
    if len(events) != len(states):
        raise ValueError("there must be an event for each state")
    stops = np.zeros(len(states), dtype=np.int8)
    _check_rows(parameters, states)
    cdef int8_t[::1] why = stops
    cdef signed char[::1] at = states.view("i1")
    cdef signed char[::1] to = events.view("i1")
    cdef size_t count = len(states)
    cdef _Workspace work = _kept.__dict__.pop("workspace", None) or _Workspace()
    cdef capsule_batch many
    memset(&many, 0, sizeof(many))
    many.stride = 1
    many.parameters = <const capsule_parameters *> &parameters[0, 0]
    many.states = <capsule_state *> &at[0]
    many.stops = &why[0]
    many.first = <capsule_event *> &to[0]
    many.lanes = lanes
    with nogil:
        capsule_run_many(&many, count, periods, work.workspace)
    _kept.workspace = work
    return stops


def steady_many(const double[:, ::1] parameters, states, double[:, :, ::1] strobe,
                double tolerance, int8_t[::1] stops, motions, uint8_t[:, ::1] switches,
                watch=None):
    """Find the periodic motion of every finished row, one whose stop is DONE.

    `states` holds the final states of runs, at the end of a period, and row i of `strobe` the state
    before the last periods and those at their ends, as `run_many` writes them. `stops` receives the
    result of the search, `motions` (of MOTION) the motions. Row i of `switches` receives one byte
    for every switch of a period of the motion, the field before it, from the end of the run on; a
    motion with more switches than half the row holds stops at FULL.
    """
    if motions.dtype != MOTION:
        raise TypeError("motions must be of dtype MOTION")
    cdef Py_ssize_t i, k, count = len(states)
    _check_rows(parameters, states)
    _need(stops.shape[0] == count, "stops", (count,))
    _need(motions.shape == (count,), "motions", (count,))
    _need(strobe.shape[0] == count and strobe.shape[1] > 1 and strobe.shape[2] == 3, "strobe",
          (count, "2 or more", 3))
    _need(switches.shape[0] == count and switches.shape[1] > 0, "switches", (count, "1 or more"))
    cdef attention a
    cdef signed char[::1] at = states.view("i1")
    cdef signed char[::1] to = motions.view("i1")
    cdef capsule_state *records = <capsule_state *> &at[0]
    cdef capsule_motion *found = <capsule_motion *> &to[0]
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
    _attend(&a, watch, None if watch is None else watch.flag)
    with nogil:
        for i in range(count):
            if stops[i] != 0:
                continue
            if a.stopped or capsule_asked(&a.watch, MAP_WORK):
                stops[i] = 3
                continue
            if not made:
                made = True
                capsule_map_make(<const capsule_parameters *> &parameters[i, 0], work)
            else:
                capsule_map_remake(<const capsule_parameters *> &parameters[i, 0], work)
            stops[i] = <int8_t> capsule_steady(work, &records[i], <double (*)[3]> &strobe[i, 1, 0],
                                               periods, tolerance, events, room, &a.watch,
                                               &found[i], &open_)
            for k in range(found[i].switches):
                switches[i, k] = <uint8_t> events[k].field
    free(work)
    free(events)
    _raised(&a)


cdef class _OrbitWorkspace:
    """Workspace of `orbit_many`, which keeps the tables of the last flows."""

    cdef capsule_map *map
    cdef capsule_segment *segments
    cdef size_t room

    def __cinit__(self):
        self.map = <capsule_map *> calloc(1, sizeof(capsule_map))
        self.room = 256
        self.segments = <capsule_segment *> malloc(self.room * sizeof(capsule_segment))
        if self.map is NULL or self.segments is NULL:
            raise MemoryError()

    def __dealloc__(self):
        free(self.map)
        free(self.segments)


def orbit_many(const double[:, ::1] parameters, const double[:, ::1] states,
               const int32_t[::1] period_numbers, int8_t[::1] stops, orbits, fields=None,
               bint energies=False, bint forces=False, bint gradients=False, watch=None):
    """Solve for the periodic motions near states (n, 3) at forcing angle 0; `orbits` (of ORBIT).

    `stops` receives the result of each; rows whose stop is not DONE at the start are skipped. Row i
    of `fields` receives the fields of its run from angle 0, as many as fit, followed by 0. Other
    results are computed on request. A motion with more than 256 segments stops at FULL.
    """
    if orbits.dtype != ORBIT:
        raise TypeError("orbits must be of dtype ORBIT")
    cdef Py_ssize_t i, k, count = parameters.shape[0], kept = 0
    cdef _OrbitWorkspace work
    _need(parameters.shape[1] == CAPSULE_PARAMETER_COUNT, "parameters",
          (count, CAPSULE_PARAMETER_COUNT))
    _need(states.shape[0] == count and states.shape[1] == 3, "states", (count, 3))
    _need(period_numbers.shape[0] == count, "period_numbers", (count,))
    _need(stops.shape[0] == count, "stops", (count,))
    _need(orbits.shape == (count,), "orbits", (count,))
    cdef uint8_t[:, ::1] passed
    if fields is not None:
        passed = fields
        _need(passed.shape[0] == count and passed.shape[1] > 0, "fields", (count, "1 or more"))
        kept = passed.shape[1]
    if not count:
        return
    cdef attention a
    cdef signed char[::1] to = orbits.view("i1")
    cdef capsule_orbit *found = <capsule_orbit *> &to[0]
    cdef capsule_orbit_request request
    # Removed while it is used: a signal handler may call this function again.
    work = _kept.__dict__.pop("orbits", None) or _OrbitWorkspace()
    request.segments, request.room = work.segments, work.room
    request.energies, request.forces, request.gradients = energies, forces, gradients
    request.watch = _attend(&a, watch, None if watch is None else watch.flag)
    with nogil:
        for i in range(count):
            if stops[i] != 0:
                continue
            if a.stopped or capsule_asked(&a.watch, MAP_WORK):
                stops[i] = 3
                continue
            capsule_map_remake(<const capsule_parameters *> &parameters[i, 0], work.map)
            stops[i] = <int8_t> capsule_solve_orbit(work.map, &states[i, 0], period_numbers[i],
                                                    &request, &found[i])
            for k in range(kept):
                passed[i, k] = <uint8_t> (request.segments[k].field if k < found[i].segments else 0)
    _raised(&a)
    _kept.orbits = work
