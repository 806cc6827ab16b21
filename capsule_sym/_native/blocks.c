/* Elimination of an itinerary's unknowns, segment by segment.

   In a window of rows, those of a segment and those carried to it, its duration and its start are
   eliminated; the remaining rows are carried to the next segment. A pivot is the largest of its column in
   the window. Rows of one segment alone have no safe pivot: at a graze its guard has no rate, and the later
   segments determine the states of an unstable orbit. The last rows carried and those that close the orbit
   are one small system. */
#include "blocks.h"

#include "linear.h"

static void exchange(double *one, double *other, int count)
{
    for (int j = 0; j < count && one != other; j++) {
        const double kept = one[j];
        one[j] = other[j], other[j] = kept;
    }
}

void capsule_blocks_fill(capsule_blocks *blocks, const capsule_equations *e, const capsule_system *at,
                         const double *direction)
{
    for (int i = 0; i < e->count; i++)
        capsule_segment_block(e, i, at, direction, blocks->segments[i].rows);
    capsule_closing_block(e, direction, blocks->closing);
}

/* Fills the rows of a window: the segment's own, with the next start, and those carried. */
static void fill_window(capsule_block *segment, double carried[CARRIED][WINDOW_COLUMNS - OWN])
{
    memset(segment->window, 0, sizeof segment->window);
    for (int r = 0; r < BLOCK_ROWS; r++) {
        memcpy(segment->window[r], segment->rows[r], OWN * sizeof(double));
        segment->window[r][WINDOW_COLUMNS - 1] = segment->rows[r][OWN];
        if (r < BLOCK_STATES)
            segment->window[r][OWN + r] = -1.0;
    }
    for (int r = 0; r < CARRIED; r++) {
        double *const row = segment->window[BLOCK_ROWS + r];
        memcpy(row + 1, carried[r], BLOCK_STATES * sizeof(double));
        memcpy(row + OWN + BLOCK_STATES, carried[r] + BLOCK_STATES, BORDER * sizeof(double));
    }
}

/* Eliminates a segment's own unknowns from its window; 0 where a pivot is 0. */
static int eliminate(capsule_block *segment)
{
    double(*const a)[WINDOW_COLUMNS] = segment->window;
    int regular = 1;
    for (int k = 0; k < OWN; k++) {
        int best = k;
        for (int i = k + 1; i < WINDOW_ROWS; i++)
            if (fabs(a[i][k]) > fabs(a[best][k]))
                best = i;
        segment->order[k] = best;
        exchange(a[k] + k, a[best] + k, WINDOW_COLUMNS - k);
        regular &= a[k][k] != 0.0;
        for (int i = k + 1; i < WINDOW_ROWS; i++) {
            if (a[i][k] == 0.0)
                continue;
            const double factor = a[i][k] / a[k][k];
            a[i][k] = factor;
            for (int j = k + 1; j < WINDOW_COLUMNS; j++)
                a[i][j] -= factor * a[k][j];
        }
    }
    return regular;
}

int capsule_blocks_factor(capsule_blocks *blocks, capsule_watch *watch)
{
    enum { HELD = CARRIED - 1 }; /* row of the fixed unknown, 0 before its segment */
    double carried[CARRIED][WINDOW_COLUMNS - OWN] = {{0.0}};
    int regular = 1;
    for (int k = 0; k < BLOCK_STATES; k++)
        carried[k][k] = 1.0, carried[k][BLOCK_STATES + k] = -1.0;
    if (blocks->held < DURATION)
        carried[HELD][BLOCK_STATES + (blocks->held < 0 ? BORDER - 1 : blocks->held)] = 1.0;
    for (int i = 0; i < blocks->count; i++) {
        capsule_block *const segment = &blocks->segments[i];
        if (capsule_asked(watch, 4))
            return -1;
        fill_window(segment, carried);
        if (blocks->held == DURATION + i)
            segment->window[BLOCK_ROWS + HELD][0] = 1.0;
        regular &= eliminate(segment);
        for (int r = 0; r < CARRIED; r++)
            memcpy(carried[r], segment->window[BLOCK_ROWS + r] + OWN, sizeof carried[r]);
    }
    memcpy(blocks->end, carried, sizeof carried);
    memcpy(blocks->end[CARRIED], blocks->closing, sizeof blocks->closing);
    return regular & capsule_factor(blocks->end[0], BLOCK_ENDS, blocks->order);
}

/* Applies the elimination of a segment to right sides: to those carried on, and to those kept. */
static inline void take_over(const capsule_block *segment, const double *guard, double *carried,
                             double *kept, int columns)
{
    double b[WINDOW_ROWS][BLOCK_RIGHT_SIDES] = {{0.0}};
    for (int j = 0; j < columns; j++) {
        b[BLOCK_ROWS - 1][j] = guard[j];
        for (int r = 0; r < CARRIED; r++)
            b[BLOCK_ROWS + r][j] = carried[r * columns + j];
    }
    for (int k = 0; k < OWN; k++) {
        exchange(b[k], b[(int)segment->order[k]], columns);
        for (int i = k + 1; i < WINDOW_ROWS; i++)
            for (int j = 0; j < columns; j++)
                b[i][j] -= segment->window[i][k] * b[k][j];
    }
    for (int j = 0; j < columns; j++) {
        for (int k = 0; k < OWN; k++)
            kept[k * columns + j] = b[k][j];
        for (int r = 0; r < CARRIED; r++)
            carried[r * columns + j] = b[OWN + r][j];
    }
}

/* Replaces the kept right sides by a segment's own unknowns, from the next start and the border. */
static inline void take_back(const capsule_block *segment, const double *next, const double *border,
                             double *kept, int columns)
{
    for (int k = OWN; k-- > 0;) {
        const double *const row = segment->window[k];
        for (int j = 0; j < columns; j++) {
            double sum = kept[k * columns + j];
            for (int i = k + 1; i < OWN; i++)
                sum -= row[i] * kept[i * columns + j];
            for (int i = 0; i < BLOCK_STATES; i++)
                sum -= row[OWN + i] * next[i * columns + j];
            for (int i = 0; i < BORDER; i++)
                sum -= row[OWN + BLOCK_STATES + i] * border[i * columns + j];
            kept[k * columns + j] = sum / row[k];
        }
    }
}

static inline void solve(const capsule_blocks *blocks, double *right, int first, int columns)
{
    const int n = blocks->count;
    const size_t width = (size_t)columns * sizeof(double);
    double end[BLOCK_ENDS * BLOCK_RIGHT_SIDES] = {0.0};
    for (int i = 0; i < n; i++)
        if (i < first)
            memset(blocks->kept[i], 0, OWN * width);
        else
            take_over(&blocks->segments[i], &right[i * columns], end, blocks->kept[i], columns);
    memcpy(&end[CARRIED * columns], &right[n * columns], BLOCK_STATES * width);
    capsule_substitute(blocks->end[0], BLOCK_ENDS, blocks->order, end, (size_t)columns);
    const double *const border = &end[BLOCK_STATES * columns], *next = end;
    for (int i = n; i-- > 0; next = blocks->kept[i] + columns) {
        take_back(&blocks->segments[i], next, border, blocks->kept[i], columns);
        memcpy(&right[(DURATION + i) * columns], blocks->kept[i], width);
    }
    memcpy(right, border, BLOCK_STATES * width);
    if (blocks->held >= 0)
        memcpy(&right[blocks->held * columns], border + BLOCK_STATES * columns, width);
}

void capsule_blocks_solve(const capsule_blocks *blocks, double *right, int first)
{
    solve(blocks, right, first, 1);
}

void capsule_blocks_solve_many(const capsule_blocks *blocks, double *right, int first)
{
    solve(blocks, right, first, BLOCK_RIGHT_SIDES);
}

void capsule_blocks_product(const capsule_blocks *blocks, const double *z, double *product)
{
    const int n = blocks->count, held = blocks->held;
    double ends[CLOSING_COLUMNS] = {0.0}; /* of the last segment, the first, and the parameter */
    memcpy(ends + BLOCK_STATES, z, BLOCK_STATES * sizeof *z);
    if (held >= 0 && held < DURATION)
        ends[BLOCK_STATES + held] = 0.0;
    memcpy(ends, ends + BLOCK_STATES, BLOCK_STATES * sizeof *z);
    ends[CLOSING_COLUMNS - 1] = held >= 0 ? z[held] : 0.0;
    for (int i = 0; i < n; i++) {
        double given[BLOCK_COLUMNS] = {held == DURATION + i ? 0.0 : z[DURATION + i]};
        memcpy(given + 1, ends, BLOCK_STATES * sizeof *z);
        given[BLOCK_COLUMNS - 1] = ends[CLOSING_COLUMNS - 1];
        for (int r = 0; r < BLOCK_ROWS; r++) {
            double *const to = r < BLOCK_STATES ? &ends[r] : &product[i];
            *to = 0.0;
            for (int k = 0; k < BLOCK_COLUMNS; k++)
                *to += blocks->segments[i].rows[r][k] * given[k];
        }
    }
    for (int r = 0; r < BLOCK_STATES; r++) {
        product[n + r] = 0.0;
        for (int k = 0; k < CLOSING_COLUMNS; k++)
            product[n + r] += blocks->closing[r][k] * ends[k];
    }
}

void capsule_blocks_transposed(const capsule_blocks *blocks, const double *residual, double *product)
{
    const int n = blocks->count, held = blocks->held;
    double ends[CLOSING_COLUMNS] = {0.0};
    for (int r = 0; r < BLOCK_STATES; r++)
        for (int k = 0; k < CLOSING_COLUMNS; k++)
            ends[k] += blocks->closing[r][k] * residual[n + r];
    for (int i = n; i-- > 0;) {
        double given[BLOCK_COLUMNS] = {0.0};
        for (int r = 0; r < BLOCK_ROWS; r++)
            for (int k = 0; k < BLOCK_COLUMNS; k++)
                given[k] += blocks->segments[i].rows[r][k] * (r < BLOCK_STATES ? ends[r] : residual[i]);
        product[DURATION + i] = given[0];
        memcpy(ends, given + 1, BLOCK_STATES * sizeof *ends);
        ends[CLOSING_COLUMNS - 1] += given[BLOCK_COLUMNS - 1];
    }
    for (int k = 0; k < BLOCK_STATES; k++)
        product[k] = ends[k] + ends[BLOCK_STATES + k];
    if (held >= 0)
        product[held] = ends[CLOSING_COLUMNS - 1];
}
