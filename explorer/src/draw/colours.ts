// Colours of both themes, told apart by all eyes. Fields, regions and the accent are the figures', in the dark brighter.

import COLOURS from "../../../capsule_sym/_figures/colours.json" with { type: "json" };
import { MODEL } from "../scene.ts";

export interface Theme {
  dark: boolean;
  ink: string;
  soft: string; // labels
  line: string; // grid
  paper: string;
  accent: string;
  mark: string;
  fields: readonly string[]; // by contact and drift: none, in front and behind, each forward, at rest and backward
  itineraries: readonly string[]; // regions of a chart, plain and then striped
  open: string; // what is not periodic
}

const LIGHT: Theme = {
  dark: false,
  ink: "#16202c",
  soft: "#52606f",
  line: "#e3e8ee",
  paper: "#ffffff",
  accent: COLOURS.series[0] ?? "#000000",
  mark: "#b3261e",
  fields: COLOURS.fields,
  itineraries: COLOURS.regions,
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
  fields: ["#3f98e0", "#f07b3f", "#f0b0d8", "#1fc397", "#f5f5f5", "#f2bd45", "#5f7086", "#8f7367", "#c81e48"],
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

/** A field's colour, mixed with the ground while the drive is low. */
export function fieldColour(field: number, theme: Theme): string {
  const { contact, drift, level } = MODEL.FIELDS[field] ?? { contact: 0, drift: 0, level: 0 };
  const colour = theme.fields[3 * contact + 1 - drift] ?? theme.ink;
  return level ? mixed(colour, theme.paper, COLOURS.pale) : colour;
}

/** The same behind curves. */
export const tint = (field: number, theme: Theme): string => `${fieldColour(field, theme)}20`;

const channels = (colour: string): number[] => [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16));
const hex = (values: readonly number[]): string => `#${values.map((value) => Math.round(value).toString(16).padStart(2, "0")).join("")}`;

const mixed = (colour: string, other: string, share: number): string =>
  hex(channels(colour).map((value, i) => value + share * ((channels(other)[i] ?? 0) - value)));

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
