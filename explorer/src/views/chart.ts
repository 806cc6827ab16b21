// A chart drawn: regions of itineraries with their names, or progression and period number as colours.
import { FONT, extent, frame, label } from "../draw/axes.ts";
import type { Frame } from "../draw/axes.ts";
import { graded, readable } from "../draw/colours.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Chart } from "../chart.ts";
import { NUMBERS } from "../fields.ts";

export function drawChart(chart: Chart, by: string, cursor: readonly [number, number] | null, pen: Pen, width: number, height: number, theme: Theme): void {
  const name = (axis: Chart["x"]): string => `${NUMBERS[axis].name.replace(" at the start", "")} ${NUMBERS[axis].symbol}`;
  const area = frame(pen, width, height, chart.xs, chart.ys, [name(chart.x), name(chart.y)], theme);
  if (chart.size) {
    const colour = painter(chart, by, theme);
    cells(chart, area, colour, pen);
    if (by !== "progression") names(chart, area, theme, pen);
    else scale(chart, area, pen);
  }
  pen.strokeStyle = theme.soft;
  pen.lineWidth = 1;
  pen.strokeRect(area.left, area.top, area.width, area.height);
  if (!cursor) return;
  pen.strokeStyle = theme.ink;
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.arc(area.x(cursor[0]), area.y(cursor[1]), 7, 0, 2 * Math.PI);
  pen.stroke();
}

function painter(chart: Chart, by: string, theme: Theme): (k: number) => string {
  const [low, high] = extent([...chart.progressions].filter(Number.isFinite));
  return (k) => {
    const region = chart.of[k] ?? -1;
    if (region === -1) return theme.paper;
    if (region === -3) return theme.mark;
    if (region === -2) return theme.open;
    if (by === "progression") return graded(((chart.progressions[k] ?? low) - low) / (high - low || 1));
    if (by === "period") return graded(Math.log2(chart.regions[region]?.multiple ?? 1) / 4);
    return wordColour(region, theme);
  };
}

export const wordColour = (region: number, theme: Theme): string => theme.words[region % theme.words.length] ?? theme.soft;

/** Cells as runs of one colour along rows. */
function cells(chart: Chart, area: Frame, colour: (k: number) => string, pen: Pen): void {
  const n = chart.size;
  const edge = (k: number, length: number): number => Math.round((k / n) * length);
  for (let j = 0; j < n; j++) {
    const [top, bottom] = [area.top + area.height - edge(j + 1, area.height), area.top + area.height - edge(j, area.height)];
    for (let from = 0; from < n; ) {
      const first = colour(chart.at(from, j));
      let to = from + 1;
      while (to < n && colour(chart.at(to, j)) === first) to++;
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
    const word = chart.regions[region]?.word ?? "";
    const text = word.length > 12 ? `${word.slice(0, 10)}…` : word;
    pen.font = `600 ${FONT}`;
    if (pen.measureText(text).width > ((2 * depth + 1) * area.width) / coarse) continue;
    pen.fillStyle = readable(wordColour(region, theme));
    pen.fillText(text, area.left + ((i + 0.5) / coarse) * area.width, area.top + area.height - ((j + 0.5) / coarse) * area.height);
  }
}

function ring(grid: readonly (readonly number[])[], i: number, j: number, r: number, region: number): boolean {
  for (let k = -r; k <= r; k++)
    for (const [a, b] of [[i + k, j - r], [i + k, j + r], [i - r, j + k], [i + r, j + k]] as const)
      if (grid[b]?.[a] !== region) return false;
  return true;
}

function scale(chart: Chart, area: Frame, pen: Pen): void {
  const [low, high] = extent([...chart.progressions].filter(Number.isFinite));
  const [w, h] = [Math.min(160, area.width * 0.4), 9];
  const [x, y] = [area.left + area.width - w - 12, area.top + 12];
  pen.fillStyle = "#ffffffd8";
  pen.fillRect(x - 8, y - 6, w + 16, h + 28);
  for (let k = 0; k < 40; k++) {
    pen.fillStyle = graded(k / 39);
    pen.fillRect(x + (k * w) / 40, y, w / 40 + 0.5, h);
  }
  pen.fillStyle = "#000000";
  pen.font = FONT;
  pen.textBaseline = "top";
  pen.textAlign = "left";
  pen.fillText(label(low, 0.01), x, y + h + 4);
  pen.textAlign = "right";
  pen.fillText(label(high, 0.01), x + w, y + h + 4);
}
