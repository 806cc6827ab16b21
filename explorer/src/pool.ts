// The workers: made from the page's own text, so that nothing is loaded from anywhere.
import type { Answer, Ask, Job } from "./jobs.ts";
import { SCENE } from "./scene.ts";

type Listener = (answer: Answer) => void;

interface Member {
  worker: Worker;
  jobs: Set<number>; // given and not done
}

export class Pool {
  private readonly members: Member[] = [];
  private readonly listeners = new Map<number, Listener>();
  private next = 1;

  /** `failed` gets the reason why a worker gave a job up; the job is then done. */
  constructor(
    script: string,
    code: WebAssembly.Module,
    private readonly failed: (why: string) => void,
    size = Math.max(1, Math.min(8, navigator.hardwareConcurrency || 2)),
  ) {
    const url = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    for (let i = 0; i < size; i++) {
      const worker = new Worker(url, { name: `scene=${SCENE}` });
      const member: Member = { worker, jobs: new Set() };
      worker.onmessage = ({ data }: MessageEvent<Answer>) => this.hear(member, data);
      worker.onerror = (event) => {
        event.preventDefault();
        this.lose(member, event.message || "it could not be started");
      };
      worker.onmessageerror = () => this.lose(member, "its answer could not be read");
      send(worker, { code });
      this.members.push(member);
    }
  }

  get size(): number {
    return this.members.length;
  }

  /** Gives a job to the worker with the fewest; its number cancels it. */
  give(ask: Job, listener: Listener): number {
    const job = this.next++;
    this.listeners.set(job, listener);
    const [first, ...others] = this.members;
    if (first) {
      const member = others.reduce((least, one) => (one.jobs.size < least.jobs.size ? one : least), first);
      member.jobs.add(job);
      send(member.worker, { job, ask });
    } else {
      queueMicrotask(() => this.end(job));
    }
    return job;
  }

  /** The job's answers are not heard any more, and its worker leaves it soon. */
  cancel(job: number): void {
    if (!this.listeners.delete(job)) return;
    for (const { worker } of this.members) send(worker, { cancel: job });
  }

  private hear(member: Member, answer: Answer): void {
    if ("ready" in answer) return;
    if ("failed" in answer) {
      const wanted = this.listeners.has(answer.job);
      this.hear(member, { job: answer.job, done: true });
      if (wanted) this.failed(answer.failed);
      return;
    }
    if ("done" in answer) {
      member.jobs.delete(answer.job);
      this.end(answer.job);
    } else this.listeners.get(answer.job)?.(answer);
  }

  private end(job: number): void {
    const listener = this.listeners.get(job);
    this.listeners.delete(job);
    listener?.({ job, done: true });
  }

  /** A worker that died leaves its jobs undone: they end here, and the page shows the reason. */
  private lose(member: Member, why: string): void {
    const at = this.members.indexOf(member);
    if (at >= 0) this.members.splice(at, 1);
    member.worker.terminate();
    for (const job of member.jobs) this.end(job);
    this.failed(why);
  }
}

const send = (worker: Worker, ask: Ask): void => worker.postMessage(ask);
