// Time histories by uPlot: relative displacement, both velocities, the fields as bands behind them.
import uPlot from "uplot";
import { withUnit } from "../device.ts";
import { BESIDE, FONT, MATHS, UNIT, besides, extent, frame, padded } from "../draw/axes.ts";
import { fieldColour, tint } from "../draw/colours.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Motion } from "../motion.ts";
import { PULSES, driveAt, edges } from "../scene.ts";
import { column, eachSegment } from "./phase.ts";

const CURVES = [
  { name: "x_r", column: 2, dash: [] },
  { name: "v_r", column: 3, dash: [7, 4] },
  { name: "v_c", column: 4, dash: [2, 3] },
] as const;

const STRIP = 22; // height of the drive's own strip, above the fields

/** The drive over what is drawn, as a share of its range: excitation periods, and 0 to 1 from the lowest to the highest value. */
function driveOf({ parameters: p, turns }: Motion): (readonly [number, number])[] {
  const [, fall = NaN] = edges(p);
  const within = PULSES.length ? [0, fall, fall, 1] : Array.from({ length: 33 }, (_, k) => k / 32);
  const values = within.map((at, k) => driveAt(p, PULSES.length ? (k < 2 ? 0 : fall) : at));
  const [low, high] = extent([0, ...values]);
  return Array.from({ length: turns || 1 }, (_, turn) => within.map((at, k) => [turn + at, ((values[k] ?? 0) - low) / (high - low || 1)] as const)).flat();
}

/** The axes: time, in periods or in a unit, and displacement; where they have units, velocities on an axis beside. */
const axesOf = ({ units: { time, length, velocity }, period }: Motion) => ({
  si: length.name !== "",
  time: time.name ? time.factor : 1 / period,
  clock: time.name ? `t (${time.name})` : CLOCK,
  y: length.factor,
  beside: velocity.factor / length.factor,
  names: [withUnit("displacement", length), withUnit("velocities", velocity)] as const,
});
const CLOCK = "ωτ/2π (periods)";

const strokes = (theme: Theme): string[] => [theme.ink, theme.accent, theme.mark];

export class History {
  private plot: uPlot | null = null;
  private motion: Motion | null = null;
  private look: Theme | null = null;
  private si = false;

  constructor(
    private readonly box: HTMLElement,
    private readonly theme: () => Theme,
  ) {
    new ResizeObserver(() => {
      const [width, height] = [box.clientWidth, box.clientHeight];
      if (this.plot && width && (this.plot.width !== width || this.plot.height !== height)) this.plot.setSize({ width, height });
      else if (!this.plot && width) this.show(this.motion);
    }).observe(box);
  }

  /** Makes the plot, and makes it again after a change of its look or its units. */
  private prepare(): void {
    const si = this.motion !== null && axesOf(this.motion).si;
    if (this.box.clientWidth && (this.look !== this.theme() || si !== this.si)) this.make();
    this.si = si;
  }

  show(motion: Motion | null): void {
    this.motion = motion;
    if (!motion || !this.box.clientWidth) return;
    this.prepare();
    const { time, y } = axesOf(motion);
    const scaled = (k: number, factor: number): number[] => column(motion.points, k).map((value) => value * factor);
    this.plot?.setData([scaled(1, time), ...CURVES.map((one) => scaled(one.column, y))]);
  }

  private make(): void {
    this.plot?.destroy();
    const theme = (this.look = this.theme());
    const axes = this.motion && axesOf(this.motion);
    const si = axes?.si && axes;
    const beside = (_: uPlot, low: number, high: number): uPlot.Range.MinMax => {
      const factor = this.motion ? axesOf(this.motion).beside : 1;
      return [low * factor, high * factor];
    };
    const named = (label: string): object => ({ label, labelFont: MATHS, labelSize: 22 * UNIT });
    const axis = { stroke: theme.soft, grid: { stroke: theme.line, width: 1 }, ticks: { show: false }, font: FONT };
    const upright = { ...axis, size: 52 * UNIT, values: (_: uPlot, values: number[]) => values.map((value) => String(value).replace("-", "−")) };
    this.plot = new uPlot(
      {
        width: this.box.clientWidth,
        height: this.box.clientHeight,
        padding: [8, 12, 0, 0],
        scales: { x: { time: false }, ...(si && { beside: { from: "y", range: beside } }) },
        legend: { show: false },
        cursor: { points: { size: 7 }, drag: { x: true, y: false } },
        axes: [
          { ...axis, ...named(axes?.clock ?? CLOCK), size: 30 * UNIT },
          { ...upright, ...(si && named(si.names[0])) },
          ...(si ? [{ ...upright, ...named(si.names[1]), side: 1 as const, scale: "beside", grid: { show: false } }] : []),
        ],
        series: [
          {},
          ...CURVES.map((one, i) => ({ label: one.name, stroke: strokes(theme)[i] ?? theme.ink, width: 2 * UNIT, dash: one.dash.map((length) => length * UNIT), points: { show: false } })),
        ],
        hooks: { drawClear: [(plot: uPlot) => this.bands(plot)] },
      },
      [[], [], [], []],
      this.box,
    );
  }

  private bands(plot: uPlot): void {
    const { motion, look } = this;
    if (!motion || !look) return;
    const { ctx, bbox } = plot;
    const { time } = axesOf(motion);
    const times = column(motion.points, 1);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    const ratio = (devicePixelRatio || 1) * UNIT;
    eachSegment(motion, (field, from, to) => {
      const x = (i: number): number => plot.valToPos((times[i] ?? 0) * time, "x", true);
      const [a, b] = [x(from), x(to - 1)];
      ctx.fillStyle = tint(field, look);
      ctx.fillRect(a, bbox.top, b - a, bbox.height);
      ctx.fillStyle = fieldColour(field, look);
      ctx.fillRect(a, bbox.top + bbox.height - 5 * ratio, b - a, 5 * ratio);
      if (b - a > 22 * ratio) {
        ctx.font = `${11 * ratio}px system-ui, sans-serif`;
        ctx.textAlign = "center";
        ctx.textBaseline = "top";
        ctx.fillStyle = look.soft;
        ctx.fillText(`F${field}`, (a + b) / 2, bbox.top + 3 * ratio);
      }
    });
    ctx.strokeStyle = ctx.fillStyle = look.soft;
    ctx.lineWidth = 1.25 * ratio;
    ctx.beginPath();
    for (const [turn, share] of driveOf(motion)) ctx.lineTo(plot.valToPos(turn * motion.period * time, "x", true), bbox.top + bbox.height - (8 + share * STRIP) * ratio);
    ctx.stroke();
    ctx.textAlign = "left";
    ctx.fillText("drive", bbox.left + 4 * ratio, bbox.top + bbox.height - (STRIP + 24) * ratio);
    ctx.restore();
  }
}

/** The same as a picture on any pen, for SVG. */
export function drawHistory(motion: Motion, pen: Pen, width: number, height: number, theme: Theme): void {
  const { si, time, clock, y, beside, names } = axesOf(motion);
  const times = column(motion.points, 1).map((value) => value * time);
  const curves = CURVES.map((one) => column(motion.points, one.column).map((value) => value * y));
  const range = padded(extent(curves.flat()));
  const area = frame(pen, width, height, [0, (motion.turns || 1) * motion.period * time], range, [clock, si ? names[0] : "x_r, v_r, v_c"], theme, si ? BESIDE : 0);
  if (si) besides(pen, area, [range[0] * beside, range[1] * beside], names[1], theme);
  eachSegment(motion, (field, from, to) => {
    const [a, b] = [area.x(times[from] ?? 0), area.x(times[to - 1] ?? 0)];
    pen.fillStyle = fieldColour(field, theme);
    pen.fillRect(a, area.top + area.height - 5, b - a, 5);
  });
  pen.strokeStyle = theme.soft;
  pen.lineWidth = 1;
  pen.beginPath();
  driveOf(motion).forEach(([turn, share], i) => {
    const place = [area.x(turn * motion.period * time), area.top + area.height - 8 - share * STRIP] as const;
    if (i) pen.lineTo(...place);
    else pen.moveTo(...place);
  });
  pen.stroke();
  curves.forEach((values, k) => {
    pen.strokeStyle = strokes(theme)[k] ?? theme.ink;
    pen.lineWidth = 1.75;
    pen.setLineDash(CURVES[k]?.dash ?? []);
    pen.beginPath();
    values.forEach((value, i) => (i ? pen.lineTo(area.x(times[i] ?? 0), area.y(value)) : pen.moveTo(area.x(times[i] ?? 0), area.y(value))));
    pen.stroke();
  });
  pen.setLineDash([]);
}
