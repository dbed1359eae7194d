// Choices that the browser keeps. Browsers may refuse storage, for example to files.

/** The choice of a key; null without one. */
export function stored(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

/** Stores a choice. If the browser refuses storage, only the caller has the choice, until the page closes. */
export function store(key: string, choice: string): void {
  try {
    localStorage.setItem(key, choice);
  } catch {
    // The page has the choice.
  }
}
