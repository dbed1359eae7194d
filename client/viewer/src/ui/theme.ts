import { button } from './dom';

const KEY = 'partiemc-theme';

/** Dark or light theme: the system's, until the user chooses. */
export class Theme {
  private readonly system = matchMedia('(prefers-color-scheme: dark)');
  private chosen = stored();

  constructor(private readonly changed: (dark: boolean) => void) {
    button('theme').addEventListener('click', () => {
      this.chosen = this.isDark ? 'light' : 'dark';
      store(this.chosen);
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

/** Browsers may refuse storage, for example to files. */
function stored(): string | null {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

function store(theme: string): void {
  try {
    localStorage.setItem(KEY, theme);
  } catch {
    // The choice lasts until the page closes.
  }
}
