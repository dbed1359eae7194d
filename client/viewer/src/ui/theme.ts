import { button } from './dom';
import { store, stored } from './storage';

const KEY = 'partiemc-theme';

/** Dark or light theme: the system's, until the user chooses. */
export class Theme {
  private readonly system = matchMedia('(prefers-color-scheme: dark)');
  private chosen = stored(KEY);

  constructor(private readonly changed: (dark: boolean) => void) {
    button('theme').addEventListener('click', () => {
      this.chosen = this.isDark ? 'light' : 'dark';
      store(KEY, this.chosen);
      this.apply();
    });
    this.system.addEventListener('change', () => this.apply());
    this.apply();
  }

  get isDark(): boolean {
    return this.chosen === null ? this.system.matches : this.chosen === 'dark';
  }

  private apply(): void {
    document.documentElement.dataset.theme = this.isDark ? 'dark' : 'light';
    button('theme').setAttribute('aria-pressed', String(this.isDark));
    this.changed(this.isDark);
  }
}
