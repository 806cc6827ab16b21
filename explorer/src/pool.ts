// The workers: made from the page's own text, so that nothing is loaded from anywhere.
import type { Answer, Ask, Job } from "./jobs.ts";

type Listener = (answer: Answer) => void;

interface Hand {
  worker: Worker;
  jobs: Set<number>; // given and not done
}

export class Pool {
  private readonly hands: Hand[] = [];
  private readonly listeners = new Map<number, Listener>();
  private next = 1;

  /** `failed` is told why a worker gave a job up; the job is then done. */
  constructor(
    script: string,
    code: WebAssembly.Module,
    private readonly failed: (why: string) => void,
    size = Math.max(1, Math.min(8, navigator.hardwareConcurrency || 2)),
  ) {
    const url = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    for (let i = 0; i < size; i++) {
      const worker = new Worker(url);
      const hand: Hand = { worker, jobs: new Set() };
      worker.onmessage = ({ data }: MessageEvent<Answer>) => this.hear(hand, data);
      worker.onerror = (event) => {
        event.preventDefault();
        this.lose(hand, event.message || "it could not be started");
      };
      worker.onmessageerror = () => this.lose(hand, "its answer could not be read");
      send(worker, { code });
      this.hands.push(hand);
    }
  }

  get size(): number {
    return this.hands.length;
  }

  /** Gives a job to the worker with the fewest; its number cancels it. */
  give(ask: Job, listener: Listener): number {
    const job = this.next++;
    this.listeners.set(job, listener);
    const [first, ...others] = this.hands;
    if (first) {
      const hand = others.reduce((least, one) => (one.jobs.size < least.jobs.size ? one : least), first);
      hand.jobs.add(job);
      send(hand.worker, { job, ask });
    } else {
      queueMicrotask(() => this.end(job));
    }
    return job;
  }

  /** The job's answers are not heard any more, and its worker leaves it soon. */
  cancel(job: number): void {
    if (!this.listeners.delete(job)) return;
    for (const { worker } of this.hands) send(worker, { cancel: job });
  }

  private hear(hand: Hand, answer: Answer): void {
    if ("ready" in answer) return;
    if ("failed" in answer) {
      const wanted = this.listeners.has(answer.job);
      this.hear(hand, { job: answer.job, done: true });
      if (wanted) this.failed(answer.failed);
      return;
    }
    if ("done" in answer) {
      hand.jobs.delete(answer.job);
      this.end(answer.job);
    } else this.listeners.get(answer.job)?.(answer);
  }

  private end(job: number): void {
    const listener = this.listeners.get(job);
    this.listeners.delete(job);
    listener?.({ job, done: true });
  }

  /** A worker that died leaves its jobs undone: they end here, and the page says why. */
  private lose(hand: Hand, why: string): void {
    const at = this.hands.indexOf(hand);
    if (at >= 0) this.hands.splice(at, 1);
    hand.worker.terminate();
    for (const job of hand.jobs) this.end(job);
    this.failed(why);
  }
}

const send = (worker: Worker, ask: Ask): void => worker.postMessage(ask);
