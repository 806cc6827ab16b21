// A chart drawn: regions of itineraries with their names, or progression and period number as colours.
import { FONT, MATHS, UNIT, extent, frame, label, ticks } from "../draw/axes.ts";
import type { Frame, Range } from "../draw/axes.ts";
import { graded, readable, shaded } from "../draw/colours.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Chart } from "../chart.ts";
import { NUMBERS } from "../fields.ts";

export const LEFT_OPEN = -3;
const LARGEST = 16; // period number of the brightest colour: the library looks for no longer motion
const BAR = 82; // what the colour bar takes at the right

export function drawChart(chart: Chart, by: string, cursor: readonly [number, number] | null, pen: Pen, width: number, height: number, theme: Theme): Frame {
  const name = (axis: Chart["x"]): string => `${NUMBERS[axis].name.replace(" at the start", "")} ${NUMBERS[axis].symbol}${chart.plainly}`;
  const area = frame(pen, width, height, chart.xs, chart.ys, [name(chart.x), name(chart.y)], theme, by === "progression" ? BAR : 0);
  if (chart.size) {
    cells(chart, area, painter(chart, by, theme), pen);
    if (by === "progression") scale(chart, area, pen, theme);
    else if (by !== "period") names(chart, area, theme, pen);
  }
  pen.strokeStyle = theme.soft;
  pen.lineWidth = 1;
  pen.strokeRect(area.left, area.top, area.width, area.height);
  if (!cursor) return area;
  pen.lineWidth = 1.5 * UNIT;
  for (const [radius, colour] of [[7, theme.ink], [8.5, theme.paper]] as const) {
    pen.strokeStyle = colour;
    pen.beginPath();
    pen.arc(area.x(cursor[0]), area.y(cursor[1]), radius * UNIT, 0, 2 * Math.PI);
    pen.stroke();
  }
  return area;
}

/** The progressions' least and largest value. */
export const progressionRange = (chart: Chart): Range => extent([...chart.progressions].filter(Number.isFinite));

/** The colour of a cell at a place on the grid. */
function painter(chart: Chart, by: string, theme: Theme): (k: number, i: number, j: number) => string {
  const [low, high] = progressionRange(chart);
  // Stripes as wide as can be told apart, at any number of cells.
  const stripe = Math.max(1, Math.round(chart.size / 64)) * (chart.step || 16);
  return (k, i, j) => {
    const region = chart.of[k] ?? -1;
    if (region === -1) return theme.paper;
    if (region === LEFT_OPEN) return theme.mark;
    if (region === -2) return theme.open;
    if (by === "progression") {
      const value = chart.progressions[k] ?? NaN;
      return Number.isFinite(value) ? graded((value - low) / (high - low || 1)) : theme.open;
    }
    if (by === "period") return periodColour(chart.regions[region]?.periodNumber ?? 1);
    const rank = chart.rank(region);
    const colour = itineraryColour(rank, theme);
    return striped(rank, theme) && Math.floor((i + j) / stripe) % 4 === 0 ? shaded(colour) : colour;
  };
}

export const periodColour = (periodNumber: number): string => graded(Math.log2(periodNumber) / Math.log2(LARGEST));
/** Colour of a region, by its rank. */
export const itineraryColour = (rank: number, theme: Theme): string => theme.itineraries[rank % theme.itineraries.length] ?? theme.soft;
/** True if drawn in stripes, because its colour is already in use. */
export const striped = (rank: number, theme: Theme): boolean => Math.floor(rank / theme.itineraries.length) % 2 === 1;

/** Cells as runs of one colour along rows. */
function cells(chart: Chart, area: Frame, colour: (k: number, i: number, j: number) => string, pen: Pen): void {
  const n = chart.size;
  const edge = (k: number, length: number): number => Math.round((k / n) * length);
  for (let j = 0; j < n; j++) {
    const [top, bottom] = [area.top + area.height - edge(j + 1, area.height), area.top + area.height - edge(j, area.height)];
    for (let from = 0; from < n; ) {
      const first = colour(chart.at(from, j), from, j);
      let to = from + 1;
      while (to < n && colour(chart.at(to, j), to, j) === first) to++;
      pen.fillStyle = first;
      const left = edge(from, area.width);
      pen.fillRect(area.left + left, top, edge(to, area.width) - left, bottom - top);
      from = to;
    }
  }
}

/** A region's digits where a coarse grid finds its widest place. */
function names(chart: Chart, area: Frame, theme: Theme, pen: Pen): void {
  const n = chart.size;
  const coarse = 32;
  const grid = Array.from({ length: coarse }, (_, j) => Array.from({ length: coarse }, (_, i) => chart.of[chart.at(at(i), at(j))] ?? -1));
  function at(k: number): number {
    return Math.min(n - 1, Math.floor(((k + 0.5) / coarse) * n));
  }
  const best = new Map<number, { i: number; j: number; depth: number }>();
  for (let j = 0; j < coarse; j++)
    for (let i = 0; i < coarse; i++) {
      const region = grid[j]?.[i] ?? -1;
      if (region < 0) continue;
      let depth = 0;
      while (depth < 8 && ring(grid, i, j, depth + 1, region)) depth++;
      if (depth > (best.get(region)?.depth ?? 0)) best.set(region, { i, j, depth });
    }
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  for (const [region, { i, j, depth }] of best) {
    const itinerary = chart.regions[region]?.itinerary ?? "";
    const text = itinerary.length > 12 ? `${itinerary.slice(0, 10)}…` : itinerary;
    pen.font = `600 ${FONT}`;
    if (pen.measureText(text).width > ((2 * depth + 1) * area.width) / coarse) continue;
    pen.fillStyle = readable(itineraryColour(chart.rank(region), theme));
    pen.fillText(text, area.left + ((i + 0.5) / coarse) * area.width, area.top + area.height - ((j + 0.5) / coarse) * area.height);
  }
}

function ring(grid: readonly (readonly number[])[], i: number, j: number, r: number, region: number): boolean {
  for (let k = -r; k <= r; k++)
    for (const [a, b] of [[i + k, j - r], [i + k, j + r], [i - r, j + k], [i + r, j + k]] as const)
      if (grid[b]?.[a] !== region) return false;
  return true;
}

/** The colour bar of the progression, with its values. */
function scale(chart: Chart, area: Frame, pen: Pen, theme: Theme): void {
  const range = progressionRange(chart);
  const [low, high] = range;
  const [x, w] = [area.left + area.width + 12 * UNIT, 14 * UNIT];
  const shades = 64;
  for (let k = 0; k < shades; k++) {
    pen.fillStyle = graded(k / (shades - 1));
    const top = area.top + area.height * (1 - (k + 1) / shades);
    pen.fillRect(x, top, w, area.height / shades + 0.5);
  }
  pen.strokeStyle = theme.soft;
  pen.lineWidth = 1;
  pen.strokeRect(x, area.top, w, area.height);
  pen.fillStyle = theme.soft;
  pen.font = FONT;
  pen.textBaseline = "middle";
  pen.textAlign = "left";
  const values = high > low ? ticks(range, area.height / (46 * UNIT)) : [low];
  const step = Math.abs((values[1] ?? 1) - (values[0] ?? 0)) || 1;
  for (const value of values) {
    const y = high > low ? area.top + area.height * (1 - (value - low) / (high - low)) : area.top + area.height / 2;
    pen.fillRect(x + w, y - 0.5, 4 * UNIT, 1);
    pen.fillText(label(value, step), x + w + 6 * UNIT, y);
  }
  pen.save();
  pen.fillStyle = theme.ink;
  pen.font = MATHS;
  pen.textAlign = "center";
  pen.textBaseline = "alphabetic";
  pen.translate(area.left + area.width + (BAR - 2) * UNIT, area.top + area.height / 2);
  pen.rotate(-Math.PI / 2);
  pen.fillText(`progression per period${chart.plainly}`, 0, 0);
  pen.restore();
}
