// What the page asks of its workers, and what they answer.
import type { Axis, Parameter } from "./fields.ts";
import type { Cell, Column, Parameters, Triple } from "./core.ts";

/** A diagram's columns, one after another, each from where the one before ended, or from `start`. */
export interface SweepJob {
  kind: "sweep";
  base: Parameters;
  x: Parameter;
  values: number[];
  periods: number;
  start: Triple;
  /** Whether a column begins where the one before it ended. */
  onward: boolean;
}

export interface SweepPart {
  from: number; // index of the first column
  columns: Column[];
}

/** The bifurcations between two columns. */
export interface MarkJob {
  kind: "mark";
  base: Parameters;
  x: Parameter;
  /** Values of neighbouring columns, in the order in which they were run. */
  from: number;
  to: number;
  start: Triple;
  periods: number;
}

export interface Mark {
  value: number;
  /** Half the width within which it lies: rounding where the event's equation was solved. */
  doubt: number;
  exact: boolean;
  name: string;
  before: string;
  after: string;
}

/** Cells of a chart, each at two coordinates. */
export interface CellsJob {
  kind: "cells";
  base: Parameters;
  start: Triple;
  x: Axis;
  y: Axis;
  places: (readonly [number, number])[];
  periods: number;
}

export type Job = SweepJob | MarkJob | CellsJob;
export type Ask = { job: number; ask: Job } | { cancel: number } | { code: ArrayBuffer };
export type Answer =
  | { job: number; part: SweepPart }
  | { job: number; marks: Mark[] }
  | { job: number; cells: Cell[] }
  | { job: number; done: true }
  | { ready: true };
