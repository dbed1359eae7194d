// Credits for frames in flight to the page: enough for a fast stream of small frames, and few enough
// that large frames do not queue in the browser.

const LEAST = 4;
const MOST = 64;
const BYTES_IN_FLIGHT = 8 << 20;
/** Least share of the target that is sent as credits at once. A message for each frame would cost more than the frame. */
const BATCH_SHARE = 1 / 4;
export const FIRST_CREDITS = 8;

export class Credit {
  private inFlight = FIRST_CREDITS;
  private meanBytes = 0;

  /** Accounts for a received frame. Returns the credits to send; 0 until a batch is due. */
  taken(bytes: number): number {
    this.meanBytes = this.meanBytes === 0 ? bytes : 0.9 * this.meanBytes + 0.1 * bytes;
    this.inFlight--;
    const target = Math.min(MOST, Math.max(LEAST, Math.floor(BYTES_IN_FLIGHT / this.meanBytes)));
    const more = target - this.inFlight;
    if (more < BATCH_SHARE * target) return 0;
    this.inFlight += more;
    return more;
  }
}
