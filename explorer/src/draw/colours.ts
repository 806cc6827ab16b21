// Colours of both themes: fields in the hues of the paper and of the figures, told apart by all eyes.

export interface Theme {
  dark: boolean;
  ink: string;
  soft: string; // labels
  line: string; // grid
  paper: string;
  accent: string;
  mark: string;
  fields: readonly string[]; // by field - 1
  tints: readonly string[]; // the same behind curves
  itineraries: readonly string[]; // regions of a chart, plain and then striped
  open: string; // what is not periodic
}

const LIGHT: Theme = {
  dark: false,
  ink: "#16202c",
  soft: "#52606f",
  line: "#e3e8ee",
  paper: "#ffffff",
  accent: "#0b5cab",
  mark: "#b3261e",
  fields: ["#0072B2", "#D55E00", "#CC79A7", "#009E73", "#000000", "#E69F00"],
  tints: ["#0072B21c", "#D55E001c", "#CC79A72a", "#009E731e", "#00000016", "#E69F0026"],
  itineraries: ["#88ccee", "#ddcc77", "#117733", "#cc6677", "#332288", "#44aa99", "#aa4499", "#999933", "#882255"],
  open: "#f4f4f6",
};

const DARK: Theme = {
  dark: true,
  ink: "#e8edf3",
  soft: "#a3b0bf",
  line: "#2a3542",
  paper: "#141b24",
  accent: "#7cc0ff",
  mark: "#ff7d8f",
  fields: ["#3f98e0", "#f07b3f", "#f0b0d8", "#1fc397", "#f5f5f5", "#f2bd45"],
  tints: ["#3f98e024", "#f07b3f22", "#f0b0d824", "#1fc39722", "#f5f5f51c", "#f2bd4524"],
  itineraries: LIGHT.itineraries,
  open: "#232c37",
};

export const themeOf = (dark: boolean): Theme => (dark ? DARK : LIGHT);

/** Black or white, whichever reads better on a colour. */
export function readable(colour: string): string {
  const channel = (at: number): number => {
    const value = Number.parseInt(colour.slice(at, at + 2), 16) / 255;
    return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
  };
  return 0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5) > 0.22 ? "#000000" : "#ffffff";
}

const channels = (colour: string): number[] => [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16));
const hex = (values: readonly number[]): string => `#${values.map((value) => Math.round(value).toString(16).padStart(2, "0")).join("")}`;

/** The colour of the stripes on a colour: lighter or darker, whichever is seen better. */
export function shaded(colour: string): string {
  const to = readable(colour) === "#000000" ? 0 : 255;
  return hex(channels(colour).map((value) => value + 0.45 * (to - value)));
}

/** A colour between two ends, for a share in [0, 1]: dark blue to yellow, as cividis. */
export function graded(share: number): string {
  const stops = [[0, 34, 78], [53, 69, 108], [102, 105, 112], [148, 142, 119], [200, 184, 102], [254, 232, 56]] as const;
  const at = Math.max(0, Math.min(0.99999, share)) * (stops.length - 1);
  const [a, b] = [stops[Math.floor(at)] ?? stops[0], stops[Math.floor(at) + 1] ?? stops[5]];
  return hex(a.map((value, i) => value + (at % 1) * ((b[i] ?? 0) - value)));
}
