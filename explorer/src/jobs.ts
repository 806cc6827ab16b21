// Jobs of the page for its workers, and their results.
import type { Axis, Parameter } from "./fields.ts";
import type { Cell, Column, Parameters, Triple } from "./core.ts";

/** Start of runs: a state, and the time within the excitation period. */
export interface Start {
  state: Triple;
  phase: number;
}

/** A diagram's columns, one after another, each from where the one before ended, or from `start`. */
export interface SweepJob {
  kind: "sweep";
  base: Parameters;
  x: Parameter;
  values: number[];
  periods: number;
  start: Start;
  /** True if a column begins at the end of the last one. */
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
  start: Triple; // at phase 0
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
  /** A state at phase 0 from which the motion beside it is run. */
  start: Triple;
}

/** Cells of a chart, each at two coordinates. */
export interface CellsJob {
  kind: "cells";
  base: Parameters;
  start: Start;
  x: Axis;
  y: Axis;
  places: (readonly [number, number])[];
  periods: number;
}

export type Job = SweepJob | MarkJob | CellsJob;
export type Ask = { job: number; ask: Job } | { cancel: number } | { code: WebAssembly.Module };
export type Answer =
  | { job: number; part: SweepPart }
  | { job: number; marks: Mark[] }
  | { job: number; cells: Cell[] }
  | { job: number; done: true }
  | { job: number; failed: string }
  | { ready: true };
