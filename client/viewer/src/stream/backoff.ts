/** Pauses between tries: from `first` milliseconds, twice as long each time, up to `longest`. */
export class Backoff {
  private next: number;

  constructor(private readonly first = 200, private readonly longest = 2000) {
    this.next = first;
  }

  /** Milliseconds to wait before the next try. */
  take(): number {
    const pause = this.next;
    this.next = Math.min(2 * this.next, this.longest);
    return pause;
  }

  /** After a success. */
  reset(): void {
    this.next = this.first;
  }
}
