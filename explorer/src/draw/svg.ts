// A pen that writes SVG: the part of a canvas's context that the page draws with.

export type Pen = Pick<
  CanvasRenderingContext2D,
  | "beginPath" | "moveTo" | "lineTo" | "closePath" | "arc" | "rect" | "stroke" | "fill" | "clip" | "save" | "restore"
  | "fillRect" | "strokeRect" | "fillText" | "setLineDash" | "translate" | "rotate" | "measureText"
  | "strokeStyle" | "fillStyle" | "lineWidth" | "lineJoin" | "lineCap" | "font" | "textAlign" | "textBaseline" | "globalAlpha"
>;

const escape = (text: string): string =>
  text.replace(/[&<>"]/g, (one) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[one] ?? one);
const short = (value: number): string => String(Math.round(value * 100) / 100);

export class SvgPen implements Pen {
  strokeStyle: string | CanvasGradient | CanvasPattern = "#000";
  fillStyle: string | CanvasGradient | CanvasPattern = "#000";
  lineWidth = 1;
  lineJoin: CanvasLineJoin = "round";
  lineCap: CanvasLineCap = "butt";
  font = "12px sans-serif";
  textAlign: CanvasTextAlign = "left";
  textBaseline: CanvasTextBaseline = "alphabetic";
  globalAlpha = 1;
  private dash: number[] = [];
  private path = "";
  private groups: number[] = [];
  private readonly parts: string[] = [];
  private clips = 0;
  private open = 0;
  private kept: Partial<SvgPen>[] = [];

  constructor(
    private readonly width: number,
    private readonly height: number,
    private readonly measure: (text: string, font: string) => number,
  ) {}

  beginPath(): void {
    this.path = "";
  }
  moveTo(x: number, y: number): void {
    this.path += `M${short(x)} ${short(y)}`;
  }
  lineTo(x: number, y: number): void {
    this.path += `L${short(x)} ${short(y)}`;
  }
  closePath(): void {
    this.path += "Z";
  }
  rect(x: number, y: number, w: number, h: number): void {
    this.path += `M${short(x)} ${short(y)}h${short(w)}v${short(h)}h${short(-w)}Z`;
  }
  arc(x: number, y: number, r: number): void {
    this.path += `M${short(x - r)} ${short(y)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
  }
  stroke(): void {
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    this.parts.push(`<path d="${this.path}" fill="none" stroke="${String(this.strokeStyle)}" stroke-width="${short(this.lineWidth)}" stroke-linejoin="round" stroke-linecap="${this.lineCap}"${dash}${this.alpha()}/>`);
  }
  fill(): void {
    this.parts.push(`<path d="${this.path}" fill="${String(this.fillStyle)}"${this.alpha()}/>`);
  }
  clip(): void {
    const id = `clip${++this.clips}`;
    this.parts.push(`<clipPath id="${id}"><path d="${this.path}"/></clipPath><g clip-path="url(#${id})">`);
    this.open++;
  }
  save(): void {
    const { strokeStyle, fillStyle, lineWidth, lineCap, font, textAlign, textBaseline, globalAlpha } = this;
    this.kept.push({ strokeStyle, fillStyle, lineWidth, lineCap, font, textAlign, textBaseline, globalAlpha });
    this.groups.push(this.open);
  }
  restore(): void {
    const until = this.groups.pop() ?? 0;
    for (; this.open > until; this.open--) this.parts.push("</g>");
    Object.assign(this, this.kept.pop());
  }
  translate(x: number, y: number): void {
    this.parts.push(`<g transform="translate(${short(x)} ${short(y)})">`);
    this.open++;
  }
  rotate(angle: number): void {
    this.parts.push(`<g transform="rotate(${short((angle * 180) / Math.PI)})">`);
    this.open++;
  }
  fillRect(x: number, y: number, w: number, h: number): void {
    this.parts.push(`<rect x="${short(x)}" y="${short(y)}" width="${short(w)}" height="${short(h)}" fill="${String(this.fillStyle)}"${this.alpha()}/>`);
  }
  strokeRect(x: number, y: number, w: number, h: number): void {
    this.beginPath();
    this.rect(x, y, w, h);
    this.stroke();
  }
  fillText(text: string, x: number, y: number): void {
    const anchor = { left: "start", start: "start", center: "middle", right: "end", end: "end" }[this.textAlign];
    const shift = { top: "0.8em", hanging: "0.8em", middle: "0.32em", alphabetic: "0", ideographic: "0", bottom: "-0.2em" }[this.textBaseline];
    this.parts.push(`<text x="${short(x)}" y="${short(y)}" dy="${shift}" text-anchor="${anchor}" style="font:${escape(this.font)}" fill="${String(this.fillStyle)}">${escape(text)}</text>`);
  }
  setLineDash(dash: Iterable<number>): void {
    this.dash = [...dash];
  }
  measureText(text: string): TextMetrics {
    return { width: this.measure(text, this.font) } as TextMetrics;
  }
  private alpha(): string {
    return this.globalAlpha < 1 ? ` opacity="${this.globalAlpha}"` : "";
  }

  text(background: string, title: string): string {
    const size = `width="${this.width}" height="${this.height}" viewBox="0 0 ${this.width} ${this.height}"`;
    return `<svg xmlns="http://www.w3.org/2000/svg" ${size}><title>${escape(title)}</title><rect width="100%" height="100%" fill="${background}"/>${this.parts.join("")}</svg>\n`;
  }
}
