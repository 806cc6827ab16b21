// State of the page, and notification of its changes.
import { themeOf } from "./draw/colours.ts";
import type { Theme } from "./draw/colours.ts";
import type { Core } from "./core.ts";
import type { Pool } from "./pool.ts";
import { SCENE, sceneOf } from "./scene.ts";
import { conflict, converted, format, parse } from "./state.ts";
import type { State } from "./state.ts";

type Listener = (state: State, before: State) => void;

export class App {
  state: State;
  theme: Theme;
  /** Reason why the address was refused, if it was. */
  refused: string;
  /** Reason why a worker failed, if one did. */
  failed = "";
  private readonly listeners: Listener[] = [];
  private writing = 0;
  /** Counts gestures: all changes of one make one step of the browser's history. */
  private gesture = 0;
  private written = 0;

  constructor(private readonly makePool: (failed: (why: string) => void) => Pool) {
    const { state, refused } = parse(location.hash);
    this.state = state;
    this.refused = refused;
    const kept = history.state as { dark?: boolean } | null;
    this.theme = themeOf(kept?.dark ?? matchMedia("(prefers-color-scheme: dark)").matches);
    for (const begins of ["pointerdown", "focusin", "change"]) addEventListener(begins, () => this.gesture++, true);
  }

  private loaded: Core | undefined;
  /** The library, once it is there. */
  get core(): Core {
    if (!this.loaded) throw new Error("the library is not there yet");
    return this.loaded;
  }
  get ready(): boolean {
    return this.loaded !== undefined;
  }
  set core(core: Core) {
    this.loaded = core;
  }

  private made: Pool | undefined;
  /** The workers, made when they are first needed. */
  get pool(): Pool {
    return (this.made ??= this.makePool((why) => {
      this.failed = why;
      this.tell();
    }));
  }

  listen(listener: Listener): void {
    this.listeners.push(listener);
  }

  /** Changes the state if that is allowed; otherwise returns the message. */
  change(change: Partial<State>): string {
    const next = { ...this.state, ...change };
    // The motion starts where it did, in the other units.
    if (next.units !== this.state.units && !("x_r" in change)) Object.assign(next, converted(this.state, next));
    const why = conflict(next);
    if (why) return why;
    const before = this.state;
    [this.state, this.refused, this.failed] = [next, "", ""];
    this.tell(before);
    this.write();
    return "";
  }

  tell(before: State = this.state): void {
    for (const listener of this.listeners) listener(this.state, before);
  }

  setTheme(dark: boolean): void {
    this.theme = themeOf(dark);
    document.documentElement.classList.toggle("dark", dark);
    this.tell();
  }

  get address(): string {
    const fragment = format(this.state);
    return location.href.replace(/#.*$/, "") + (fragment ? `#${fragment}` : "");
  }

  /** Puts the state into the address once changes pause; the first time in a gesture as a step of the history. */
  private write(): void {
    clearTimeout(this.writing);
    this.writing = window.setTimeout(() => {
      const fragment = `#${format(this.state)}`;
      if (location.hash === fragment || (fragment === "#" && !location.hash)) return;
      const same = this.written === this.gesture;
      this.written = this.gesture;
      try {
        if (same) history.replaceState(null, "", fragment);
        else history.pushState(null, "", fragment);
      } catch {
        // A page from a file may not have its history written.
        if (same) location.replace(fragment);
        else location.assign(fragment);
      }
    }, 200);
  }

  /** Takes a state from an address: one that was changed by hand, or from the history. */
  read(fragment: string): void {
    clearTimeout(this.writing);
    this.gesture++;
    if (sceneOf(fragment) !== SCENE) {
      // A page is of one scene. Data that are not in the address stay with their entry in the history.
      history.replaceState({ dark: this.theme.dark }, "");
      location.reload();
      return;
    }
    if (fragment.replace(/^#/, "") === format(this.state) && !this.refused) return;
    const { state, refused } = parse(fragment);
    const before = this.state;
    [this.state, this.refused, this.failed] = [state, refused, ""];
    this.tell(before);
  }
}
