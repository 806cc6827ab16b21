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
        int (*widest)() noexcept nogil
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
        void (*run_many)(const double *, void *, int8_t *, double (*)[3], void *, size_t, int, int, int,
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


cdef void *_memory(object array, dtype, Py_ssize_t rows=-1, bint kept=False) except? NULL:
    # First byte of an array of records, contiguous and of one axis; NULL if it is empty.
    #
    # It is written to unless it is `kept`.
    cdef const signed char[::1] view
    if array.dtype != dtype or array.ndim != 1:
        raise TypeError(f"an array of records {dtype.names} is needed, shape (n,)")
    if rows >= 0:
        _need(len(array) == rows, f"records {dtype.names}", (rows,))
    if not (kept or array.flags.writeable):
        raise ValueError(f"an array of records {dtype.names} is read-only")
    view = array.view("i1")
    return <void *> &view[0] if len(array) else NULL


cdef const double *_rows(const double[:, ::1] array, name, Py_ssize_t rows, Py_ssize_t columns) except? NULL:
    _need(array.shape[0] == rows and array.shape[1] == columns, name, (rows, columns))
    return &array[0, 0] if rows else NULL


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
        # Number of runs side by side on this processor: 8 (AVX-512), 4 (AVX2, or ARM 64) or 1.
        return self.table.lanes()

    def widths(self):
        # Numbers of lanes that may be requested for runs, besides one.
        return tuple(width for width in (4, 8) if width <= self.table.widest())

    def fields(self, parameters):
        # Closed forms of the fields at one parameter set, an array in the order of `Parameters`.
        return Fields(self, parameters, False)

    def map(self, parameters):
        # Map at one parameter set, an array in the order of `Parameters`.
        return Map(self, parameters, True)

    cdef _Memory _take(self, str name, size_t size):
        # Removed while it is used: a signal handler may call the function again.
        return self.kept.__dict__.pop(name, None) or _Memory(size)

    def start_many(self, const double[:, ::1] parameters, const double[:, ::1] starts,
                   const double[::1] phases, states, watch=None):
        # Write the state records at the starts of runs, one per row of the others.
        #
        # Records that the watch prevents have the gap nan, and no run accepts them.
        cdef Py_ssize_t count = len(states)
        cdef void *records = _memory(states, self.records.STATE)
        cdef const double *rows = _rows(parameters, "parameters", count, self.table.parameters)
        cdef const double *begin = _rows(starts, "starts", count, 3)
        _need(phases.shape[0] == count, "phases", (count,))
        cdef attention a
        cdef _Memory map_ = self._take("map", self.table.map)
        cdef capsule_watch *limit = _attend(&a, watch)
        if count:
            with nogil:
                self.table.start_many(rows, <const double (*)[3]> begin, &phases[0], records, count, map_.at, limit)
        _raised(&a)
        self.kept.map = map_

    def run_many(self, const double[:, ::1] parameters, states, int64_t periods, int8_t[::1] stops,
                 double[:, :, ::1] strobe=None, bint position=False, size_t stride=1, watch=None,
                 int lanes=0, int precision=0, first=None):
        # Run every row, or every `stride`-th, to the end of period `periods`; states are replaced.
        #
        # `stops` receives the result of each run; `strobe`, shape (rows, periods + 1, 3), the states
        # at the ends of the periods. Another call resumes runs that the watch stopped. `lanes` is the
        # number of runs side by side, 0 for as many as the processor has; `precision` is that of runs
        # outside the lanes. Returns the number of undecided runs. `first` (events) receives the first
        # switch of each run, which ends there: its field is 0 if none came before the end, and the
        # `plane` of its state is 0 if lanes found it, instead of the scalar code.
        if stride < 1:
            raise ValueError("stride must be at least 1")
        cdef Py_ssize_t i, left_open = 0, refused = 0, count = len(states)
        cdef void *records = _memory(states, self.records.STATE)
        cdef const double *rows = _rows(parameters, "parameters", count, self.table.parameters)
        cdef void *events = NULL if first is None else _memory(first, self.records.EVENT, count)
        cdef double (*marks)[3]
        marks = NULL
        _need(stops.shape[0] == count, "stops", (count,))
        if strobe is not None:
            _need(strobe.shape[0] == count and strobe.shape[1] == periods + 1 and strobe.shape[2] == 3,
                  "strobe", (count, periods + 1, 3))
            marks = <double (*)[3]> &strobe[0, 0, 0] if count else NULL
        cdef attention a
        cdef _Memory work = self._take("workspace", self.table.workspace)
        cdef capsule_watch *limit = _attend(&a, watch)
        if count:
            with nogil:
                self.table.run_many(rows, records, &stops[0], marks, events, stride, position, lanes,
                                    precision, count, periods, work.at, limit)
                for i from 0 <= i < count by stride:
                    left_open += stops[i] == _OPEN
                    refused += stops[i] == _REFUSED
        _raised(&a)
        self.kept.workspace = work
        if refused:
            raise ValueError("no runs from some of the states")
        return left_open

    def steady_many(self, const double[:, ::1] parameters, states, double[:, :, ::1] strobe,
                    double tolerance, int8_t[::1] stops, motions, uint8_t[:, ::1] switches,
                    watch=None):
        # Find the periodic motion of every finished row, one whose stop is DONE.
        #
        # `states` holds the final states of runs, at the end of a period, and row i of `strobe` the
        # state before the last periods and those at their ends, as `run_many` writes them. `stops`
        # receives the result of the search, `motions` the motions. Row i of `switches` receives one
        # byte for every switch of a period of the motion, the field before it, from the end of the run
        # on; a motion with more switches than half the row holds stops at FULL.
        cdef Py_ssize_t count = len(states)
        cdef void *records = _memory(states, self.records.STATE)
        cdef void *found = _memory(motions, self.records.MOTION, count)
        cdef const double *rows = _rows(parameters, "parameters", count, self.table.parameters)
        _need(stops.shape[0] == count, "stops", (count,))
        _need(strobe.shape[0] == count and strobe.shape[1] > 1 and strobe.shape[2] == 3, "strobe",
              (count, "2 or more", 3))
        _need(switches.shape[0] == count and switches.shape[1] > 0, "switches", (count, "1 or more"))
        if not count:
            return
        cdef attention a
        cdef _Memory map_ = _Memory(self.table.map)
        cdef _Memory events = _Memory(switches.shape[1] * self.table.event)
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            self.table.steady_many(rows, records, <double (*)[3]> &strobe[0, 0, 0],
                                   <int> strobe.shape[1] - 1, tolerance, &stops[0], found,
                                   &switches[0, 0], switches.shape[1], events.at, count, map_.at, limit)
        _raised(&a)

    def orbit_many(self, const double[:, ::1] parameters, const double[:, ::1] states,
                   const int32_t[::1] period_numbers, int8_t[::1] stops, orbits, fields=None,
                   bint energies=False, bint forces=False, bint gradients=False, watch=None):
        # Solve for the periodic motions near states (n, 3) at forcing angle 0, in `orbits`.
        #
        # `stops` receives the result of each; rows whose stop is not DONE at the start are skipped. Row
        # i of `fields` receives the fields of its run from angle 0, as many as fit, followed by 0.
        # Other results are computed on request. A motion with more than 256 segments stops at FULL.
        cdef Py_ssize_t count = parameters.shape[0]
        cdef const double *rows = _rows(parameters, "parameters", count, self.table.parameters)
        cdef const double *begin = _rows(states, "states", count, 3)
        cdef void *found = _memory(orbits, self.records.ORBIT, count)
        cdef uint8_t[:, ::1] passed
        cdef uint8_t *to = NULL
        cdef size_t kept = 0
        _need(period_numbers.shape[0] == count, "period_numbers", (count,))
        _need(stops.shape[0] == count, "stops", (count,))
        if not count:
            return
        if fields is not None:
            passed = fields
            kept = passed.shape[1]
            _need(passed.shape[0] == count and kept > 0, "fields", (count, "1 or more"))
            to = &passed[0, 0]
        cdef attention a
        cdef int results = energies + 2 * forces + 4 * gradients
        cdef _Memory map_ = self._take("orbit", self.table.map)
        cdef _Memory segments = self._take("segments", MOST_SEGMENTS * self.table.segment)
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            self.table.orbit_many(rows, <const double (*)[3]> begin, &period_numbers[0], &stops[0],
                                  found, to, kept, results, segments.at, MOST_SEGMENTS, count, map_.at,
                                  limit)
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
        # Values (4,) and Jacobian (4, columns) of one segment's closed form a duration h after start.
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
        # `start` is as for `closed_form`; `quantity` is one of `interface.Quantity`. `zeros` is 1 if its
        # rate vanishes at the start, else 0.
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
        cdef void *solution = _memory(found, found.dtype)
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
        self.table.state_at(self.map, start, _memory(out, out.dtype))
        return out.reshape(())

    def end_of_run(self, double x_r, double v_r, double v_c, double phase, int64_t periods, int precision):
        # End of a run, by `run` in pieces of records that are counted and not kept.
        #
        # Returns (x_r, v_r, v_c), x_c, whole periods and angle, and the numbers of segments,
        # evaluations and segments in 106 bits; None if a switch is undecided.
        if self.piece is None:
            self.piece = _Memory(PIECE * self.table.segment)
        return self._ended(x_r, v_r, v_c, phase, periods, precision, NULL, self.piece.at)

    def short_run(self, double x_r, double v_r, double v_c, double phase, int64_t periods, int precision):
        # End of a run as by `end_of_run`, its segments, and the states at the ends of periods.
        #
        # The first row of the states is not written. None for more segments than one piece as well.
        segments, strobe = np.empty(PIECE, self.core.records.SEGMENT), np.empty((periods + 1, 3))
        cdef double[:, ::1] marks = strobe
        end = self._ended(x_r, v_r, v_c, phase, periods, precision, <double (*)[3]> &marks[0, 0],
                          _memory(segments, self.core.records.SEGMENT))
        if end is None:
            return None
        segments.resize(end[4], refcheck=False)
        return end, segments, strobe

    cdef object _ended(self, double x_r, double v_r, double v_c, double phase, int64_t periods,
                       int precision, double (*strobe)[3], void *segments):
        cdef attention a
        cdef capsule_ended end
        cdef double start[4]
        cdef int stop
        start[0], start[1], start[2], start[3] = x_r, v_r, v_c, phase
        cdef capsule_watch *limit = _attend(&a, None)
        with nogil:
            stop = self.table.end_of_run(self.map, start, periods, precision, strobe, segments, PIECE, &end, limit)
        _raised(&a)
        if stop == _REFUSED:
            raise ValueError(f"no run from {(x_r, v_r, v_c)} at {phase}")
        if stop != _DONE:
            return None
        return ((end.state[0], end.state[1], end.state[2]), end.position, end.period, end.angle,
                end.segments, end.evaluations, end.wide)

    def run(self, state, int64_t periods, segments=None, strobe=None, bint position=False,
            watch=None, int precision=0):
        # Continue to the end of period `periods`; requested results are written to given arrays.
        #
        # `state` is a record of STATE, replaced by the final one; `segments` is an array of SEGMENT, not
        # empty; `strobe` has shape (periods + 1, 3), or fewer rows, at least ROWS: then the state at
        # the end of period k is in row k % rows, and the run pauses when half of them are new. For a
        # motion that rests forever the last ones are written. Returns the reason to stop, the number
        # of segments written, and the outcome that is undecided. `precision` is one of
        # `interface.Precision`.
        cdef void *at = _memory(state.reshape(1), self.core.records.STATE)
        cdef void *to = NULL
        cdef double[:, ::1] marks
        cdef double (*rows)[3]
        rows = NULL
        cdef int64_t reused = 0
        cdef size_t written = 0, room = 0
        cdef int stop, open_ = 0
        if strobe is not None:
            marks = strobe
            if (marks.shape[0] <= periods and marks.shape[0] < _ROWS) or marks.shape[1] != 3:
                raise ValueError(f"strobe must have shape (periods + 1, 3), or {_ROWS} rows")
            reused = marks.shape[0] if marks.shape[0] <= periods else 0
            rows = <double (*)[3]> &marks[0, 0]
        if segments is not None:
            room = len(segments)
            if not room:
                raise TypeError("segments must not be empty")
            to = _memory(segments, self.core.records.SEGMENT)
        cdef attention a
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            stop = self.table.run(self.map, at, periods, rows, reused, to, room, position, precision,
                                  &written, &open_, limit)
        _raised(&a)
        if stop == _REFUSED:
            raise ValueError(f"no run from {state}")
        return stop, written, OUTCOMES[open_]

    def evaluate(self, segments, const double[::1] times, double[:, ::1] states, bint more=False):
        # Write the states (x_r, v_r, v_c, x_c) at absolute times, shape (n, 4).
        #
        # `segments` are records of SEGMENT in their order; times that ascend, except for steps back
        # over few segments, take least. Before the first segment and after the last the state is that
        # of its start or end; with `more` to follow, it ends at the first time at or after the last
        # one's end. Returns the number of states.
        cdef size_t done, n = times.shape[0], count = len(segments)
        cdef void *records = _memory(segments, self.core.records.SEGMENT, -1, True)
        _need(<size_t> states.shape[0] == n and states.shape[1] == 4, "states", (n, 4))
        if not n or not count:
            return 0
        cdef attention a
        cdef capsule_watch *limit = _attend(&a, None)
        with nogil:
            done = self.table.evaluate(self.map, records, count, more, &times[0], n,
                                       <double (*)[4]> &states[0, 0], limit)
        _raised(&a)
        if done < n and not more:
            raise ValueError("a field that there is not")
        return done

    def differentiate(self, segments, const double[::1] times, double[:, ::1] switches,
                      double[:, :, ::1] slopes, watch=None):
        # Write the derivatives of switching times, and of (x_r, v_r, v_c, x_c) at absolute times.
        #
        # `segments` are all records of a run, one more than rows of `switches`; `times` ascend, and
        # `slopes` has the shape (times, 4, columns). The columns are the start's x_r, v_r, v_c and
        # phase, the parameters, and of `slopes` the rate of change, which `switches` does not have.
        # Returns the number of segments passed, less than all if the watch ends it.
        cdef size_t done, n = times.shape[0], count = len(segments)
        cdef void *records = _memory(segments, self.core.records.SEGMENT, -1, True)
        _need(switches.shape[0] + 1 == <Py_ssize_t> count and switches.shape[1] == self.table.slopes,
              "switches", (<Py_ssize_t> count - 1, self.table.slopes))
        _need(<size_t> slopes.shape[0] == n and slopes.shape[1] == 4 and
              slopes.shape[2] == self.table.columns, "slopes", (n, 4, self.table.columns))
        cdef attention a
        cdef double *ends = &switches[0, 0] if count > 1 else NULL
        cdef double *rows = &slopes[0, 0, 0] if n else NULL
        cdef const double *when = &times[0] if n else NULL
        cdef capsule_watch *limit = _attend(&a, watch)
        with nogil:
            done = self.table.differentiate(self.map, records, count, ends, when, n, rows, limit)
        _raised(&a)
        if done < count and not a.stopped:
            raise ValueError("a field that there is not")
        return done
