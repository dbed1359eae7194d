/** Pauses between attempts: from `first` milliseconds, doubled each time, up to `longest`. */
export class Backoff {
  private next: number;

  constructor(private readonly first = 200, private readonly longest = 2000) {
    this.next = first;
  }

  /** Milliseconds until the next attempt. */
  take(): number {
    const pause = this.next;
    this.next = Math.min(2 * this.next, this.longest);
    return pause;
  }

  reset(): void {
    this.next = this.first;
  }
}
