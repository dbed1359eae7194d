// How many frames may be under way to the page: enough for a fast stream of small frames, few
// enough that large ones do not pile up in the browser.

const LEAST = 4;
const MOST = 64;
const BYTES_UNDER_WAY = 8 << 20;
export const FIRST_CREDITS = 8;

export class Credit {
  private underWay = FIRST_CREDITS;
  private meanBytes = 0;

  /** A frame has come and was taken. Returns how many more to allow now. */
  taken(bytes: number): number {
    this.meanBytes = this.meanBytes === 0 ? bytes : 0.9 * this.meanBytes + 0.1 * bytes;
    this.underWay--;
    const wanted = Math.min(MOST, Math.max(LEAST, Math.floor(BYTES_UNDER_WAY / this.meanBytes)));
    const more = Math.max(0, wanted - this.underWay);
    this.underWay += more;
    return more;
  }
}
