// A canvas that follows its box, drawn on request and exported as PNG or SVG.
import { SvgPen } from "./svg.ts";
import type { Pen } from "./svg.ts";
import type { Theme } from "./colours.ts";

export interface Picture {
  (pen: Pen, width: number, height: number, theme: Theme): void;
}

export class Panel {
  readonly canvas: HTMLCanvasElement;
  private readonly pen: CanvasRenderingContext2D;
  width = 0;
  height = 0;
  private shown = false;

  constructor(
    readonly box: HTMLElement,
    private readonly picture: Picture,
    private readonly theme: () => Theme,
  ) {
    this.canvas = document.createElement("canvas");
    box.append(this.canvas);
    const pen = this.canvas.getContext("2d");
    if (!pen) throw new Error("this browser draws no canvas");
    this.pen = pen;
    // Measured when it is first drawn: many panels are made before the page is laid out once.
    new ResizeObserver(() => this.measure() && this.draw()).observe(box);
  }

  /** Takes the size of the box; whether it has changed. */
  private measure(): boolean {
    const [width, height] = [this.box.clientWidth, this.box.clientHeight];
    const ratio = Math.min(3, devicePixelRatio || 1);
    this.shown = width > 0 && height > 0;
    if (!this.shown) return false;
    if (width === this.width && height === this.height && this.canvas.width === Math.round(width * ratio)) return false;
    [this.width, this.height] = [width, height];
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    return true;
  }

  draw(): void {
    if (!this.shown) this.measure();
    if (!this.shown) return;
    const ratio = this.canvas.width / this.width;
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.clearRect(0, 0, this.width, this.height);
    this.pen.lineJoin = "round";
    this.picture(this.pen, this.width, this.height, this.theme());
  }

  svg(title: string): string {
    const measure = (text: string, font: string): number => {
      this.pen.font = font;
      return this.pen.measureText(text).width;
    };
    const pen = new SvgPen(this.width || 640, this.height || 400, measure);
    this.picture(pen, this.width || 640, this.height || 400, this.theme());
    return pen.text(this.theme().paper, title);
  }
}
