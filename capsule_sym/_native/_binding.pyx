# cython: boundscheck=False, wraparound=False, cdivision=True, embedsignature=True
"""Binding of C cores by their tables: arrays in, arrays out, without the GIL while they run.

It is the same for all scenes: counts, sizes and functions are those of the table. Long work stops at Ctrl-C, with
the exception of its handler, and at a `Watch`.
"""

import threading
from time import perf_counter

from libc.math cimport INFINITY
from libc.stdint cimport int8_t, int32_t, int64_t, uint8_t, uintptr_t
from libc.stdlib cimport calloc, free

import numpy as np

from capsule_sym.generated.interface import OUTCOMES, Quantity, Stop

cdef extern from "capsule_core.h" nogil:
    int CAPSULE_CORE_VERSION
    ctypedef struct capsule_watch:
        int (*ask)(void *about) noexcept nogil
        void *about
        int64_t most, done, work
    ctypedef struct capsule_extremum:
        int kind
        double time, value
    ctypedef struct capsule_ended:
        double state[3]
        double position, angle
        int64_t period, segments, evaluations, wide
    ctypedef struct capsule_core_table:
        int version
        const char *digest
        int parameters, fields, columns, slopes, constants
        size_t map, workspace, segment, event
        const size_t *layouts[8]
        int (*lanes)() noexcept nogil
        void (*make)(const double *, void *, char) noexcept nogil
        void (*constants_of)(const void *, int, double *) noexcept nogil
        void (*closed_form)(const void *, int, const double *, double, double *, double *) noexcept nogil
        int (*extrema)(const void *, int, const double *, int, int, double, capsule_extremum *, int) noexcept nogil
        void (*rooms)(int, size_t *) noexcept nogil
        int (*evaluate_itinerary)(const void *, const int32_t *, int, int, int, const double *,
                                  double *, double *) noexcept nogil
        int (*solve_itinerary)(const int32_t *, int, int, int, const double *, int, double *, double *,
                               double *, double *, double *, void *, capsule_watch *) noexcept nogil
        void (*state_at)(const void *, const double *, void *) noexcept nogil
        int (*end_of_run)(const void *, const double *, int64_t, int, double (*)[3], void *, size_t,
                          capsule_ended *, capsule_watch *) noexcept nogil
        int (*run)(const void *, void *, int64_t, double (*)[3], int64_t, void *, size_t, int, int,
                   size_t *, int *, capsule_watch *) noexcept nogil
        size_t (*evaluate)(const void *, const void *, size_t, int, const double *, size_t,
                           double (*)[4], capsule_watch *) noexcept nogil
        size_t (*differentiate)(const void *, const void *, size_t, double *, const double *, size_t,
                                double *, capsule_watch *) noexcept nogil
        void (*start_many)(const double *, const double (*)[3], const double *, void *, size_t,
                           void *, capsule_watch *) noexcept nogil
        void (*run_many)(const double *, void *, int8_t *, double (*)[3], void *, size_t, int, int,
                         size_t, int64_t, void *, capsule_watch *) noexcept nogil
        void (*steady_many)(const double *, const void *, double (*)[3], int, double, int8_t *, void *,
                            uint8_t *, size_t, void *, size_t, void *, capsule_watch *) noexcept nogil
        void (*orbit_many)(const double *, const double (*)[3], const int32_t *, int8_t *, void *,
                           uint8_t *, size_t, int, void *, size_t, size_t, void *,
                           capsule_watch *) noexcept nogil

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

cdef int _DONE = Stop.DONE, _OPEN = Stop.OPEN, _REFUSED = Stop.REFUSED, _QUANTITIES = len(Quantity)
cdef enum:
    _ROWS = 8192
    PIECE = 512  # segments written at a time: a run that pauses resumes within a rounding
    MOST_EXTREMA = 2048  # of a quantity in a segment
    MOST_SEGMENTS = 256  # of an orbit


ctypedef struct attention:
    capsule_watch watch
    int *flag
    double deadline, looked
    bint signals, raised, stopped


# The main thread alone handles signals, which needs the GIL; others may hold it.
cdef int _ask(void *about) noexcept nogil:
    cdef attention *a = <attention *> about
    cdef double time = now()
    if a.stopped or time > a.deadline or (a.flag is not NULL and (<const volatile int *> a.flag)[0]):
        a.stopped = True
    elif a.signals and not (0.0 <= time - a.looked < 0.01):
        a.looked = time
        with gil:
            if PyErr_CheckSignals() != 0:
                a.raised = a.stopped = True
    return a.stopped


cdef capsule_watch *_attend(attention *a, watch):
    cdef int[::1] flag
    a.watch.ask = _ask
    a.watch.about = a
    a.watch.most = a.watch.done = a.watch.work = 0
    a.flag = NULL
    if watch is not None:
        flag = watch.flag
        a.flag = &flag[0]
    # The clock is read last here, so that the watch is over too when this limit stops the work.
    a.deadline = (INFINITY if watch is None else <double> (watch.deadline - perf_counter())) + now()
    a.looked = now()
    a.signals = threading.current_thread() is threading.main_thread()
    a.raised = a.stopped = False
    return &a.watch


cdef int _raised(attention *a) except -1:
    # Re-raise the exception of a signal's handler.
    return -1 if a.raised else 0


cdef int _need(bint met, name, shape) except -1:
    if not met:
        raise ValueError(f"{name} must have shape {shape}")
    return 0


cdef void *_at(object array, dtype, tuple shape, bint kept=False) except? NULL:
    # First byte of a contiguous array of this type and shape; NULL if it is empty.
    #
    # It is written to unless it is `kept`.
    cdef const signed char[::1] view
    if array.dtype != dtype:
        raise TypeError(f"an array of {np.dtype(dtype)} is needed, not of {array.dtype}")
    if array.shape != shape or not array.flags.c_contiguous:
        raise ValueError(f"a contiguous array of shape {shape} is needed, not {array.shape}")
    if not (kept or array.flags.writeable):
        raise ValueError(f"an array of {array.dtype} is read-only")
    view = array.reshape(-1).view("i1")
    return <void *> &view[0] if array.size else NULL


cdef class _Memory:
    # Zeroed memory for structs of a scene, kept for later calls.

    cdef void *at

    def __cinit__(self, size_t size):
        self.at = calloc(1, size)
        if self.at is NULL:
            raise MemoryError()

    def __dealloc__(self):
        free(self.at)


cdef class Core:
    # Core of a scene, by the address of its table.
    #
    # `records` are the scene's, and `library` what has to stay loaded. Raises ValueError for a table
    # of another version, and for structs of another layout.

    DONE, FULL, OPEN, STOPPED, REFUSED = [int(stop) for stop in Stop]
    ROWS = _ROWS  # least rows of a strobe whose rows are reused
    cdef const capsule_core_table *table
    cdef object kept
    cdef readonly object records, library

    def __cinit__(self, uintptr_t table, records, library):
        self.table = <const capsule_core_table *> table
        if self.table.version != CAPSULE_CORE_VERSION:
            raise ValueError(f"a table of version {self.table.version}, not {CAPSULE_CORE_VERSION}")
        self.records, self.library, self.kept = records, library, threading.local()
        cdef Py_ssize_t i, k
        for i, dtype in enumerate(vars(records).values()):
            places = [*(dtype.fields[name][1] for name in dtype.names), dtype.itemsize]
            if places != [self.table.layouts[i][k] for k in range(len(places))]:
                raise ValueError(f"structs of another layout than {dtype.names}")

    def digest(self):
        # Digest of the generator's inputs from which the kernels were made.
        return self.table.digest.decode()

    def lanes(self):
        # Number of runs side by side on this processor: 8 (AVX-512), 4 (AVX2) or 1.
        return self.table.lanes()

    def widths(self):
        # Numbers of lanes that may be requested for runs, besides one.
        return tuple(width for width in (4, 8) if width <= self.table.lanes())

    def fields(self, parameters):
        # Closed forms of the fields at one parameter set, an array in the order of `Parameters`.
        return Fields(self, parameters, False)

    def map(self, parameters):
        # Map at one parameter set, an array in the order of `Parameters`.
        return Map(self, parameters, True)

    cdef const double *_rows(self, parameters, Py_ssize_t count) except? NULL:
        return <const double *> _at(parameters, "f8", (count, self.table.parameters), True)

    cdef _Memory _take(self, str name, size_t size):
        # Removed while it is used: a signal handler may call the function again.
        return self.kept.__dict__.pop(name, None) or _Memory(size)

    def start_many(self, parameters, starts, phases, states, watch=None):
        # Write the state records at the starts of runs, one per row of the others.
        #
        # Records that the watch prevents have the gap nan, and no run accepts them.
        cdef Py_ssize_t count = len(states)
        cdef void *records = _at(states, self.records.STATE, (count,))
        cdef const double *rows = self._rows(parameters, count)
        cdef const double *begin = <const double *> _at(starts, "f8", (count, 3), True)
        cdef const double *when = <const double *> _at(phases, "f8", (count,), True)
        cdef attention a
        cdef _Memory map_ = self._take("map", self.table.map)
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            self.table.start_many(rows, <const double (*)[3]> begin, when, records, count, map_.at, limit)
        _raised(&a)
        self.kept.map = map_

    def run_many(self, parameters, states, int64_t periods, stops, strobe=None, bint position=False,
                 size_t stride=1, watch=None, int lanes=0, first=None):
        # Run every row, or every `stride`-th, to the end of period `periods`; states are replaced.
        #
        # `stops` receives the result of each run; `strobe`, shape (rows, periods + 1, 3), the states
        # at the ends of the periods. Another call resumes runs that the watch stopped. `lanes` is the
        # number of runs side by side, 0 for as many as the processor has. Returns the number of
        # undecided runs. `first` (events) receives the first switch of each run, which ends there: its
        # field is 0 if none came before the end, and the `plane` of its state is 0 if lanes found it,
        # instead of the scalar code.
        if stride < 1:
            raise ValueError("stride must be at least 1")
        cdef Py_ssize_t count = len(states)
        cdef void *records = _at(states, self.records.STATE, (count,))
        cdef const double *rows = self._rows(parameters, count)
        cdef int8_t *ends = <int8_t *> _at(stops, "i1", (count,))
        cdef void *events = NULL if first is None else _at(first, self.records.EVENT, (count,))
        cdef void *marks = NULL if strobe is None else _at(strobe, "f8", (count, periods + 1, 3))
        cdef attention a
        cdef _Memory work = self._take("workspace", self.table.workspace)
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            self.table.run_many(rows, records, ends, <double (*)[3]> marks, events, stride, position, lanes,
                                count, periods, work.at, limit)
        _raised(&a)
        self.kept.workspace = work
        own = stops[::stride]
        if (own == _REFUSED).any():
            raise ValueError("no runs from some of the states")
        return int((own == _OPEN).sum())

    def steady_many(self, parameters, states, strobe, double tolerance, stops, motions, switches, watch=None):
        # Find the periodic motion of every finished row, one whose stop is DONE.
        #
        # `states` holds the final states of runs, at the end of a period, and row i of `strobe` the
        # state before the last periods and those at their ends, as `run_many` writes them. `stops`
        # receives the result of the search, `motions` the motions. Row i of `switches` receives one
        # byte for every switch of a period of the motion, the field before it, from the end of the run
        # on; a motion with more switches than half the row holds stops at FULL.
        cdef Py_ssize_t count = len(states)
        if not count:
            return
        if strobe.shape[1] < 2:
            raise ValueError("strobe must have the states of at least one period")
        cdef int periods = strobe.shape[1] - 1
        cdef size_t room = switches.shape[1]
        cdef void *records = _at(states, self.records.STATE, (count,), True)
        cdef void *found = _at(motions, self.records.MOTION, (count,))
        cdef const double *rows = self._rows(parameters, count)
        cdef void *marks = _at(strobe, "f8", (count, periods + 1, 3))
        cdef int8_t *ends = <int8_t *> _at(stops, "i1", (count,))
        cdef uint8_t *passed = <uint8_t *> _at(switches, "u1", (count, room))
        cdef attention a
        cdef _Memory map_ = _Memory(self.table.map), events = _Memory(room * self.table.event)
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            self.table.steady_many(rows, records, <double (*)[3]> marks, periods, tolerance, ends, found,
                                   passed, room, events.at, count, map_.at, limit)
        _raised(&a)

    def orbit_many(self, parameters, states, period_numbers, stops, orbits, fields=None,
                   bint energies=False, bint forces=False, bint gradients=False, watch=None):
        # Solve for the periodic motions near states (n, 3) at forcing angle 0, in `orbits`.
        #
        # `stops` receives the result of each; rows whose stop is not DONE at the start are skipped. Row
        # i of `fields` receives the fields of its run from angle 0, as many as fit, followed by 0.
        # Other results are computed on request. A motion with more than 256 segments stops at FULL.
        cdef Py_ssize_t count = len(parameters)
        cdef size_t kept = 0 if fields is None else fields.shape[1]
        cdef const double *rows = self._rows(parameters, count)
        cdef void *begin = _at(states, "f8", (count, 3), True)
        cdef void *found = _at(orbits, self.records.ORBIT, (count,))
        cdef const int32_t *numbers = <const int32_t *> _at(period_numbers, "i4", (count,), True)
        cdef int8_t *ends = <int8_t *> _at(stops, "i1", (count,))
        cdef void *passed = NULL if fields is None else _at(fields, "u1", (count, kept))
        cdef attention a
        cdef int results = energies + 2 * forces + 4 * gradients
        cdef _Memory map_ = self._take("orbit", self.table.map)
        cdef _Memory segments = self._take("segments", MOST_SEGMENTS * self.table.segment)
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            self.table.orbit_many(rows, <const double (*)[3]> begin, numbers, ends, found, <uint8_t *> passed,
                                  kept, results, segments.at, MOST_SEGMENTS, count, map_.at, limit)
        _raised(&a)
        self.kept.orbit, self.kept.segments = map_, segments


cdef class Fields:
    # Closed forms of the fields at one parameter set of a core; `whole` if runs follow.

    cdef Core core
    cdef _Memory memory
    cdef const capsule_core_table *table
    cdef void *map
    cdef double[::1] parameters

    def __cinit__(self, Core core not None, parameters, bint whole):
        self.core, self.table = core, core.table
        self.parameters = np.array(parameters, dtype=float)
        _need(self.parameters.shape[0] == self.table.parameters, "parameters", (self.table.parameters,))
        self.memory = _Memory(self.table.map)
        self.map = self.memory.at
        self.table.make(&self.parameters[0], self.map, c'm' if whole else c'c')

    cdef int _check(self, int field) except -1:
        if not 1 <= field <= self.table.fields:
            raise ValueError(f"field must be 1 to {self.table.fields}")
        return 0

    def closed_form(self, int field, const double[::1] start, double h):
        # Values (4,) and Jacobian (4, 12) of one segment's closed form a duration h after start.
        #
        # `start` holds x_r, gap, v_r, v_c, margin, cosine and sine of the angle. The values are
        # the change of x_r, v_r, the change of v_c, and x_c's advance; the Jacobian has their rows
        # and the columns of the generated `jacobian`. At rest the last two of each are zero.
        self._check(field)
        _need(start.shape[0] == 7, "start", (7,))
        values, rows = np.zeros(4), np.zeros((4, self.table.columns))
        cdef double[::1] out = values
        cdef double[:, ::1] slopes = rows
        self.table.closed_form(self.map, field, &start[0], h, &out[0], &slopes[0, 0])
        return values, rows

    def extrema(self, int field, start, int quantity, int zeros, double duration):
        # Extrema inside a segment, (kind, time, value) each; None if they are undecided.
        #
        # `start` is as for `closed_form`; `quantity` is one of `interface.Quantity`. The first `zeros`
        # derivatives of its rate vanish at the start.
        cdef const double[::1] at = np.array(start, dtype=float)
        cdef capsule_extremum found[MOST_EXTREMA]
        cdef int count
        self._check(field)
        _need(at.shape[0] == 7, "start", (7,))
        if not (0 <= zeros <= 1 and 0 <= quantity < _QUANTITIES):
            raise ValueError("zeros must be 0 or 1, and the quantity one of `interface.Quantity`")
        with nogil:
            count = self.table.extrema(self.map, field, &at[0], quantity, zeros, duration, found, MOST_EXTREMA)
        if count < 0:
            return None
        return [(found[i].kind, found[i].time, found[i].value) for i in range(count)]

    def constants(self, int field):
        # Constants of a field, in the order of the kernels' own.
        self._check(field)
        constants = np.empty(self.table.constants)
        cdef double[::1] out = constants
        self.table.constants_of(self.map, field, &out[0])
        return constants.tolist()

    cdef object _arrays(self, object block, int count, double advance, const size_t *room):
        # Arrays of a system, laid out in a block.
        cdef Py_ssize_t unknowns = count + 4, columns = unknowns + self.table.parameters
        cdef Py_ssize_t states = room[0] + (count + 1) * 3 * columns, residual = states + unknowns * columns
        flow = self.core.records.SEGMENT_FLOW
        end = count * flow.itemsize // 8
        return (
            block[:end].view(flow),
            block[room[0] : states].reshape(count + 1, 3, columns),
            block[end : end + unknowns],
            block[states:residual].reshape(unknowns, columns),
            block[residual : residual + columns],
            advance,
            block[end + unknowns : end + unknowns + 9].reshape(3, 3),
        )

    def evaluate_itinerary(self, const int32_t[::1] fields, int periods, bint mirrored, const double[::1] z):
        # Equations of an itinerary at unknowns z: a state, the forcing angle, n durations.
        #
        # Returns the segments as records (n,) of SEGMENT_FLOW; derivatives (n + 1, 3, columns) of the
        # states at their starts and of the last end; the residual (n + 4,) with its derivatives (n +
        # 4, columns); those of x_c's advance (columns,); that advance; and the monodromy matrix (3,
        # 3). Columns are the unknowns and the parameters.
        cdef int count = <int> fields.shape[0]
        cdef size_t room[3]
        cdef double advance
        _need(count > 0 and z.shape[0] == count + 4, "z", "(a state, an angle, one duration a field)")
        self.table.rooms(count, room)
        block = np.empty(room[1])
        cdef double[::1] numbers = block
        if self.table.evaluate_itinerary(self.map, &fields[0], count, periods, mirrored, &z[0],
                                         &numbers[0], &advance) != _DONE:
            raise ValueError(f"no itinerary of fields 1 to {self.table.fields}, each led to by one guard")
        return self._arrays(block, count, advance, room)

    def solve_itinerary(self, const int32_t[::1] fields, int periods, bint mirrored, z,
                        const double[::1] direction=None, int held=0, watch=None):
        # Solve the equations of an itinerary near unknowns z, as `capsule_solve_itinerary` does.
        #
        # Returns z, the system as of `evaluate_itinerary`, the status, the steps and the residual of the
        # search, and the parameters, which move along `direction` in place of unknown `held`. The
        # status and the system are None if the watch stopped it.
        cdef int stop, count = <int> fields.shape[0]
        cdef size_t room[3]
        cdef double advance
        cdef const double *way = NULL
        z, values = np.array(z, dtype=float), np.array(self.parameters)
        _need(count > 0 and len(z) == count + 4, "z", "(a state, an angle, one duration a field)")
        self.table.rooms(count, room)
        block, more = np.empty(room[1]), np.empty(room[2])
        found = np.zeros(1, self.core.records.SOLUTION)
        cdef double[::1] at = z, numbers = block, workspace = more, moved = values
        cdef void *solution = _at(found, found.dtype, (1,))
        if direction is not None:
            _need(direction.shape[0] == self.table.parameters, "direction", (self.table.parameters,))
            way = &direction[0]
        cdef attention a
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            stop = self.table.solve_itinerary(&fields[0], count, periods, mirrored, way, held, &moved[0],
                                              &at[0], &workspace[0], &numbers[0], &advance, solution,
                                              limit)
        _raised(&a)
        if stop == _REFUSED:
            raise ValueError(f"no itinerary of fields 1 to {self.table.fields}, or no parameters")
        done = stop == _DONE
        arrays = self._arrays(block, count, advance, room) if done else None
        residual, status, steps = found[0].item()
        return z, arrays, status if done else None, steps, residual, tuple(values.tolist())


cdef class Map(Fields):
    # Map at one parameter set.

    cdef _Memory piece

    def remake(self, *values):
        # Make this the map at other parameters; quick if those of the flow are unchanged.
        cdef Py_ssize_t i
        _need(len(values) == self.table.parameters, "parameters", (self.table.parameters,))
        for i, value in enumerate(values):
            self.parameters[i] = value
        self.table.make(&self.parameters[0], self.map, c'r')

    def state_at(self, double x_r, double v_r, double v_c, double phase):
        # State record of a start, at a time in the excitation period.
        out = np.empty(1, self.core.records.STATE)
        cdef double[4] start = [x_r, v_r, v_c, phase]
        self.table.state_at(self.map, start, _at(out, out.dtype, (1,)))
        return out.reshape(())

    def short_run(self, double x_r, double v_r, double v_c, double phase, int64_t periods, int precision,
                  bint whole):
        # End of a run, by `run` in pieces of records that are counted and not kept.
        #
        # Returns (x_r, v_r, v_c), x_c, whole periods and angle, and the numbers of segments,
        # evaluations and segments in 106 bits; None if a switch is undecided. If `whole`, these with the
        # segments and the states at the ends of periods, whose first row is not written; None for more
        # segments than one piece as well.
        cdef attention a
        cdef capsule_ended end
        cdef double[4] start = [x_r, v_r, v_c, phase]
        cdef void *marks = NULL
        cdef void *records
        cdef int stop
        if whole:
            segments, strobe = np.empty(PIECE, self.core.records.SEGMENT), np.empty((periods + 1, 3))
            marks, records = _at(strobe, "f8", (periods + 1, 3)), _at(segments, segments.dtype, (PIECE,))
        else:
            self.piece = self.piece or _Memory(PIECE * self.table.segment)
            records = self.piece.at
        cdef capsule_watch *limit = _attend(&a, None)
        with nogil:
            stop = self.table.end_of_run(self.map, start, periods, precision, <double (*)[3]> marks, records,
                                         PIECE, &end, limit)
        _raised(&a)
        if stop == _REFUSED:
            raise ValueError(f"no run from {(x_r, v_r, v_c)} at {phase}")
        if stop != _DONE:
            return None
        found = ((end.state[0], end.state[1], end.state[2]), end.position, end.period, end.angle,
                 end.segments, end.evaluations, end.wide)
        if not whole:
            return found
        segments.resize(end.segments, refcheck=False)
        return found, segments, strobe

    def run(self, state, int64_t periods, segments=None, strobe=None, bint position=False,
            watch=None, int precision=0):
        # Continue to the end of period `periods`; requested results are written to given arrays.
        #
        # `state` is a record of STATE, replaced by the final one; `segments` is an array of its
        # dtype; `strobe` has shape (periods + 1, 3), or fewer rows, at least ROWS: then the state at
        # the end of period k is in row k % rows, and the run pauses when half of them are new. For a
        # motion that rests forever the last ones are written. Returns the reason to stop, the number
        # of segments written, and the outcome that is undecided. `precision` is one of
        # `interface.Precision`.
        cdef void *at = _at(state.reshape(1), self.core.records.STATE, (1,))
        cdef size_t written = 0, room = 0 if segments is None else len(segments)
        cdef int64_t rows = 0 if strobe is None else len(strobe)
        cdef int stop, open_ = 0
        if strobe is not None and rows <= periods and rows < _ROWS:
            raise ValueError(f"strobe must have shape (periods + 1, 3), or {_ROWS} rows")
        if segments is not None and not room:
            raise TypeError("segments must not be empty")
        cdef void *marks = NULL if strobe is None else _at(strobe, "f8", (rows, 3))
        cdef void *to = NULL if segments is None else _at(segments, self.core.records.SEGMENT, (room,))
        cdef attention a
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            stop = self.table.run(self.map, at, periods, <double (*)[3]> marks,
                                  rows if rows <= periods else 0, to, room, position, precision,
                                  &written, &open_, limit)
        _raised(&a)
        if stop == _REFUSED:
            raise ValueError(f"no run from {state}")
        return stop, written, OUTCOMES[open_]

    def evaluate(self, segments, times, states, bint more=False):
        # Write the states (x_r, v_r, v_c, x_c) at absolute times, shape (n, 4).
        #
        # `segments` are records of SEGMENT in their order; times that ascend, except for steps back
        # over few segments, take least. Before the first segment and after the last the state is that
        # of its start or end; with `more` to follow, it ends at the first time after the last one's
        # end. Returns the number of states.
        cdef size_t done, n = len(times), count = len(segments)
        cdef void *records = _at(segments, self.core.records.SEGMENT, (count,), True)
        cdef const double *when = <const double *> _at(times, "f8", (n,), True)
        cdef void *to = _at(states, "f8", (n, 4))
        if not n or not count:
            return 0
        cdef attention a
        cdef capsule_watch *limit = _attend(&a, None)
        with nogil:
            done = self.table.evaluate(self.map, records, count, more, when, n, <double (*)[4]> to, limit)
        _raised(&a)
        if done < n and not more:
            raise ValueError("a field that there is not")
        return done

    def differentiate(self, segments, times, switches, slopes, watch=None):
        # Write the derivatives of switching times (n, 11), and of (x_r, v_r, v_c, x_c) at times.
        #
        # Returns the number of segments passed, less than n + 1 if the watch ends it.
        #
        # `segments` are all records of a run, n + 1 of them; `times` ascend, and `slopes` has the shape
        # (times, 4, 12). The columns are the start's x_r, v_r, v_c and phase, the parameters, and of
        # `slopes` the rate of change.
        cdef size_t done, n = len(times), count = len(segments)
        cdef void *records = _at(segments, self.core.records.SEGMENT, (count,), True)
        cdef const double *when = <const double *> _at(times, "f8", (n,), True)
        cdef double *ends = <double *> _at(switches, "f8", (count - 1, self.table.slopes))
        cdef double *rows = <double *> _at(slopes, "f8", (n, 4, self.table.columns))
        cdef attention a
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            done = self.table.differentiate(self.map, records, count, ends, when, n, rows, limit)
        _raised(&a)
        if done < count and not a.stopped:
            raise ValueError("a field that there is not")
        return done
