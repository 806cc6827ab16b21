// The workers: made from the page's own text, so that nothing is loaded from anywhere.
import type { Answer, Ask, Job } from "./jobs.ts";

type Listener = (answer: Answer) => void;

interface Hand {
  worker: Worker;
  jobs: number; // given and not done
}

export class Pool {
  private readonly hands: Hand[] = [];
  private readonly listeners = new Map<number, Listener>();
  private next = 1;

  constructor(script: string, code: Uint8Array, size = Math.max(1, Math.min(8, navigator.hardwareConcurrency || 2))) {
    const url = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    for (let i = 0; i < size; i++) {
      const worker = new Worker(url);
      const hand: Hand = { worker, jobs: 0 };
      worker.onmessage = ({ data }: MessageEvent<Answer>) => this.hear(hand, data);
      send(worker, { code: code.slice().buffer });
      this.hands.push(hand);
    }
  }

  get size(): number {
    return this.hands.length;
  }

  /** Gives a job to the worker with the fewest; its number cancels it. */
  give(ask: Job, listener: Listener): number {
    const hand = this.hands.reduce((least, one) => (one.jobs < least.jobs ? one : least));
    const job = this.next++;
    hand.jobs++;
    this.listeners.set(job, listener);
    send(hand.worker, { job, ask });
    return job;
  }

  /** The job's answers are not heard any more, and its worker leaves it soon. */
  cancel(job: number): void {
    if (!this.listeners.delete(job)) return;
    for (const { worker } of this.hands) send(worker, { cancel: job });
  }

  private hear(hand: Hand, answer: Answer): void {
    if ("ready" in answer) return;
    const listener = this.listeners.get(answer.job);
    if ("done" in answer) {
      hand.jobs--;
      this.listeners.delete(answer.job);
    }
    listener?.(answer);
  }
}

const send = (worker: Worker, ask: Ask): void =>
  "code" in ask ? worker.postMessage(ask, [ask.code]) : worker.postMessage(ask);
