import { button } from './dom';
import { store, stored } from './storage';

const KEY = 'partiemc-side';
/** Widest screen of the layout for phones, as in page.css. */
const PHONE = '(max-width: 600px)';

/** Whether an address requests only the picture and its time. */
export function isEmbedded(search: string): boolean {
  return new URLSearchParams(search).has('embed');
}

/** Whether the side panel is folded at first. `stored`: the user's choice on a wide screen, or null. */
export function foldsAtFirst(isPhone: boolean, stored: string | null): boolean {
  return isPhone || stored === 'folded';
}

/** The side panel, which can be folded. On a phone it covers the picture until a stream is chosen. */
export class Layout {
  private readonly phone = matchMedia(PHONE);

  constructor() {
    document.body.classList.toggle('embed', isEmbedded(location.search));
    button('fold').addEventListener('click', () => {
      this.fold(!document.body.classList.contains('folded'));
      if (!this.phone.matches) store(KEY, document.body.classList.contains('folded') ? 'folded' : 'open');
    });
    this.phone.addEventListener('change', () => this.fold(foldsAtFirst(this.phone.matches, stored(KEY))));
    this.fold(foldsAtFirst(this.phone.matches, stored(KEY)));
  }

  /** On a phone, folds the side panel. Call it after the user has chosen a picture there. */
  chosen(): void {
    if (this.phone.matches) this.fold(true);
  }

  /** Shows the side panel, because its form needs an answer of the user. */
  ask(): void { this.fold(false); }

  private fold(isFolded: boolean): void {
    document.body.classList.toggle('folded', isFolded);
    button('fold').setAttribute('aria-expanded', String(!isFolded));
  }
}
