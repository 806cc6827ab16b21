// Time histories by uPlot: relative displacement, both velocities, the fields as bands behind them.
import uPlot from "uplot";
import { FONT, MATHS, UNIT, extent, frame, padded } from "../draw/axes.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Motion } from "../motion.ts";
import { column, eachSegment } from "./phase.ts";

const CURVES = [
  { name: "x_r", column: 2, dash: [] },
  { name: "v_r", column: 3, dash: [7, 4] },
  { name: "v_c", column: 4, dash: [2, 3] },
] as const;

const strokes = (theme: Theme): string[] => [theme.ink, theme.accent, theme.mark];

export class History {
  private plot: uPlot | null = null;
  private motion: Motion | null = null;
  private look: Theme | null = null;

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

  /** Makes the plot before there is a motion. */
  prepare(): void {
    if (this.box.clientWidth && this.look !== this.theme()) this.make();
  }

  show(motion: Motion | null): void {
    this.motion = motion;
    if (!motion || !this.box.clientWidth) return;
    this.prepare();
    const times = column(motion.points, 1).map((time) => time / motion.period);
    this.plot?.setData([times, ...CURVES.map((one) => column(motion.points, one.column))]);
  }

  private make(): void {
    this.plot?.destroy();
    const theme = (this.look = this.theme());
    const axis = { stroke: theme.soft, grid: { stroke: theme.line, width: 1 }, ticks: { show: false }, font: FONT };
    this.plot = new uPlot(
      {
        width: this.box.clientWidth,
        height: this.box.clientHeight,
        padding: [8, 12, 0, 0],
        scales: { x: { time: false } },
        legend: { show: false },
        cursor: { points: { size: 7 }, drag: { x: true, y: false } },
        axes: [
          { ...axis, label: "ωτ/2π (periods)", labelFont: MATHS, labelSize: 22 * UNIT, size: 30 * UNIT },
          { ...axis, size: 52 * UNIT, values: (_, values) => values.map((value) => String(value).replace("-", "−")) },
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
    const times = column(motion.points, 1);
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    const ratio = (devicePixelRatio || 1) * UNIT;
    eachSegment(motion, (field, from, to) => {
      const x = (i: number): number => plot.valToPos((times[i] ?? 0) / motion.period, "x", true);
      const [a, b] = [x(from), x(to - 1)];
      ctx.fillStyle = look.tints[field - 1] ?? look.line;
      ctx.fillRect(a, bbox.top, b - a, bbox.height);
      ctx.fillStyle = look.fields[field - 1] ?? look.ink;
      ctx.fillRect(a, bbox.top + bbox.height - 5 * ratio, b - a, 5 * ratio);
      if (b - a > 22 * ratio) {
        ctx.font = `${11 * ratio}px system-ui, sans-serif`;
        ctx.textAlign = "center";
        ctx.textBaseline = "top";
        ctx.fillStyle = look.soft;
        ctx.fillText(`F${field}`, (a + b) / 2, bbox.top + 3 * ratio);
      }
    });
    ctx.restore();
  }
}

/** The same as a picture on any pen, for SVG. */
export function drawHistory(motion: Motion, pen: Pen, width: number, height: number, theme: Theme): void {
  const times = column(motion.points, 1).map((time) => time / motion.period);
  const curves = CURVES.map((one) => column(motion.points, one.column));
  const area = frame(pen, width, height, [0, motion.turns || 1], padded(extent(curves.flat())), ["ωτ/2π (periods)", "x_r, v_r, v_c"], theme);
  eachSegment(motion, (field, from, to) => {
    const [a, b] = [area.x(times[from] ?? 0), area.x(times[to - 1] ?? 0)];
    pen.fillStyle = theme.fields[field - 1] ?? theme.ink;
    pen.fillRect(a, area.top + area.height - 5, b - a, 5);
  });
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
