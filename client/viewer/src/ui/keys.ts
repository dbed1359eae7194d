/** Controls that read text or a choice from the keyboard. */
const TYPED = 'select, textarea, input:not([type=checkbox], [type=range], [type=file])';
const NAVIGATION = /^(Arrow|Page|Home$|End$)/;

/** Whether the focused control uses a key itself, so that it is no shortcut. */
export function usesKey(target: EventTarget | null, { key, ctrlKey, metaKey, altKey }: KeyboardEvent): boolean {
  if (ctrlKey || metaKey || altKey) return true;
  if (!(target instanceof Element)) return false;
  if (target.matches(TYPED)) return true;
  if (target.matches('input[type=range]')) return NAVIGATION.test(key);
  return target.matches('button, summary, input') && (key === ' ' || key === 'Enter');
}

/** After a click by pointer the control gives the focus back, so that Space is a shortcut again. */
export function releaseFocusAfterClicks(): void {
  addEventListener('click', ({ target, detail }) => {
    const control = target instanceof Element ? target.closest('button, summary, label, input[type=checkbox]') : null;
    const { activeElement } = document;
    const isLabel = control instanceof HTMLLabelElement && control.control?.matches('[type=checkbox]');
    if (detail > 0 && control && activeElement instanceof HTMLElement &&
        (isLabel || control === activeElement) && !activeElement.matches(TYPED)) activeElement.blur();
  });
}
