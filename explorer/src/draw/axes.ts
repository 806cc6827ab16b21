// Axes of a plot: ticks at round numbers, grid, labels; and the scales from values to pixels.
import type { Theme } from "./colours.ts";
import type { Pen } from "./svg.ts";

export type Range = readonly [number, number];

export interface Frame {
  left: number;
  top: number;
  width: number;
  height: number;
  x(value: number): number;
  y(value: number): number;
}

/** The values at a place in a frame, held within its ends. */
export function valuesAt(area: Frame, px: number, py: number, xs: Range, ys: Range): [number, number] {
  const share = (value: number, length: number): number => Math.max(0, Math.min(1, value / length));
  return [
    xs[0] + share(px - area.left, area.width) * (xs[1] - xs[0]),
    ys[0] + (1 - share(py - area.top, area.height)) * (ys[1] - ys[0]),
  ];
}

/** Ratio of the page's font size to 16 px; text on canvases follows it. */
export let UNIT = 1;
export let FONT = "";
export let MATHS = "";
export function measureType(): void {
  UNIT = (Number.parseFloat(getComputedStyle(document.documentElement).fontSize) || 16) / 16;
  FONT = `${12 * UNIT}px system-ui, sans-serif`;
  MATHS = `italic ${14.5 * UNIT}px Georgia, "Times New Roman", serif`;
}

/** Round numbers within a range, about so many. */
export function ticks([low, high]: Range, count: number): number[] {
  const rough = (high - low) / Math.max(1, count);
  if (!(rough > 0) || !Number.isFinite(rough)) return [];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = ([1, 2, 5, 10].find((one) => one * power >= rough * 0.999) ?? 10) * power;
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from({ length: Math.max(0, Math.min(60, last - first + 1)) }, (_, i) => (first + i) * step);
}

/** A number as short as its step allows. */
export function label(value: number, step: number): string {
  if (value === 0) return "0";
  const places = Math.max(0, Math.min(12, -Math.floor(Math.log10(step) + 1e-9)));
  const text = Math.abs(value) >= 1e6 || places > 6 ? value.toExponential(2) : value.toFixed(places);
  return text.replace("-", "−");
}

/** Some more on each side, and some width where there is none. */
export function padded([low, high]: Range, share = 0.05): Range {
  const extra = high > low ? (high - low) * share : Math.max(1e-3, Math.abs(low) * 0.05);
  return [low - extra, high + extra];
}

export function extent(values: Iterable<number>): Range {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : [0, 1];
}

const MARGINS = [58, 14, 12, 42] as const; // left, right, top, bottom

/** Text in which "x_r" has r as a subscript, at the place that the pen's alignment means. */
export function maths(pen: Pen, text: string, x: number, y: number): void {
  const parts = text.split(/([A-Za-zσταγβδωζμ]_\w)/).filter(Boolean);
  const font = pen.font;
  const small = font.replace(/[\d.]+px/, (size) => `${Number.parseFloat(size) * 0.72}px`);
  const pieces = parts.flatMap((part) => (/^._\w$/.test(part) ? [[part[0] ?? "", false] as const, [part[2] ?? "", true] as const] : [[part, false] as const]));
  const widths = pieces.map(([piece, low]) => {
    pen.font = low ? small : font;
    return pen.measureText(piece).width;
  });
  const whole = widths.reduce((sum, width) => sum + width, 0);
  const align = pen.textAlign;
  let at = align === "center" ? x - whole / 2 : align === "right" ? x - whole : x;
  pen.textAlign = "left";
  pieces.forEach(([piece, low], i) => {
    pen.font = low ? small : font;
    pen.fillText(piece, at, low ? y + 3.5 * UNIT : y);
    at += widths[i] ?? 0;
  });
  [pen.font, pen.textAlign] = [font, align];
}

export const BESIDE = 64; // what a second upright axis takes at the right

/** A second upright axis at the right of a frame, of other units. */
export function besides(pen: Pen, area: Frame, range: Range, name: string, theme: Theme): void {
  const right = area.left + area.width;
  const at = (value: number): number => area.top + area.height * (1 - (value - range[0]) / (range[1] - range[0]));
  const values = ticks(range, area.height / (46 * UNIT));
  pen.fillStyle = theme.soft;
  pen.font = FONT;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  for (const value of values) pen.fillText(label(value, Math.abs((values[1] ?? 1) - (values[0] ?? 0)) || 1), right + 7, at(value));
  pen.fillStyle = theme.ink;
  pen.font = MATHS;
  pen.textAlign = "center";
  pen.textBaseline = "alphabetic";
  pen.save();
  pen.translate(right + 60 * UNIT, area.top + area.height / 2);
  pen.rotate(-Math.PI / 2);
  maths(pen, name, 0, 0);
  pen.restore();
}

/** Axes with their names; `beside` is kept free at the right. */
export function frame(pen: Pen, width: number, height: number, xs: Range, ys: Range, names: readonly [string, string], theme: Theme, beside = 0): Frame {
  const [left, right, top, bottom] = MARGINS.map((margin) => margin * UNIT) as [number, number, number, number];
  const inner = { left, top, width: Math.max(10, width - left - right - beside * UNIT), height: Math.max(10, height - top - bottom) };
  const x = (value: number): number => inner.left + ((value - xs[0]) / (xs[1] - xs[0])) * inner.width;
  const y = (value: number): number => inner.top + inner.height - ((value - ys[0]) / (ys[1] - ys[0])) * inner.height;
  const [xt, yt] = [ticks(xs, inner.width / (60 * UNIT)), ticks(ys, inner.height / (46 * UNIT))];
  const step = (t: readonly number[]): number => Math.abs((t[1] ?? 1) - (t[0] ?? 0)) || 1;
  pen.lineWidth = 1;
  pen.strokeStyle = theme.line;
  pen.fillStyle = theme.soft;
  pen.font = FONT;
  pen.beginPath();
  for (const value of xt) {
    pen.moveTo(x(value), inner.top);
    pen.lineTo(x(value), inner.top + inner.height);
  }
  for (const value of yt) {
    pen.moveTo(inner.left, y(value));
    pen.lineTo(inner.left + inner.width, y(value));
  }
  pen.stroke();
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (const value of xt) pen.fillText(label(value, step(xt)), x(value), inner.top + inner.height + 6);
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const value of yt) pen.fillText(label(value, step(yt)), inner.left - 7, y(value));
  pen.fillStyle = theme.ink;
  pen.font = MATHS;
  pen.textAlign = "center";
  pen.textBaseline = "alphabetic";
  maths(pen, names[0], inner.left + inner.width / 2, height - 6 * UNIT);
  pen.save();
  pen.translate(15 * UNIT, inner.top + inner.height / 2);
  pen.rotate(-Math.PI / 2);
  maths(pen, names[1], 0, 0);
  pen.restore();
  return { ...inner, x, y };
}
