import type { FileInput } from '../input/drop';
import { FILE_FIELDS, type FieldError, type FileField, type FileOptions, NO_OPTIONS, SURFACE } from '../input/options';
import { button, byId, input, setText } from './dom';

const fieldOf = (field: FileField) => input(`file-${field}`);
const errorOf = (field: FileField) => byId(`file-${field}-error`, HTMLElement);

/** The options of a file: spacing, columns, filter, plane and periodic axes, with the defaults that the file shows. */
export class FileForm {
  private readonly details = byId('file-details', HTMLDetailsElement);
  private file: FileInput | null = null;

  /** `submitted`: opens the file with options, and throws FieldError. */
  constructor(private readonly submitted: (file: FileInput, options: FileOptions) => void) {
    byId('file-options', HTMLFormElement).addEventListener('submit', (event) => {
      event.preventDefault();
      this.submit();
    });
    button('file-surface').addEventListener('click', () => {
      fieldOf('slice').value = SURFACE;
      fieldOf('spacing').value ||= this.file?.facts.spacing ?? '';
      this.submit();
    });
  }

  /** Shows the options of a file, or nothing. */
  show(file: FileInput | null, options: FileOptions): void {
    this.details.open = this.details.open && file === this.file;
    this.details.hidden = file === null;
    this.file = file;
    this.clearErrors();
    if (!file) return;
    const { facts, title } = file;
    const isRecording = facts.names.length === 0;
    setText(byId('file-title', HTMLElement), `Options of ${title}`);
    setText(byId('file-names', HTMLElement), isRecording ? '' : `Columns: ${facts.names.join(', ')}`);
    fieldOf('spacing').placeholder = facts.spacing || 'estimated';
    fieldOf('columns').placeholder = facts.columns || 'x,y';
    fieldOf('slice').placeholder = facts.slice || 'z=0';
    button('file-surface').hidden = facts.slice === '';
    byId('file-filters', HTMLDataListElement).replaceChildren(...facts.filters.map((filter) => new Option(filter, filter)));
    const isNeeded: Partial<Record<FileField, boolean>> = {
      spacing: true, slice: facts.slice !== '' || facts.columns === '', periodic: facts.hasBox,
    };
    for (const field of FILE_FIELDS) {
      fieldOf(field).value = options[field];
      const isOffered = isNeeded[field] ?? !isRecording;
      for (const label of fieldOf(field).labels ?? []) label.hidden = !isOffered;
      fieldOf(field).hidden = !isOffered;
    }
  }

  /** Shows the error at the option that is missing or wrong, and fills in the defaults for 3D particles. */
  ask({ field, message }: FieldError): void {
    const facts = this.file?.facts;
    this.details.open = true;
    if (facts && facts.slice !== '') {
      for (const name of ['slice', 'spacing'] as const) fieldOf(name).value ||= facts[name];
    }
    for (const label of fieldOf(field).labels ?? []) label.hidden = false;
    fieldOf(field).hidden = false;
    fieldOf(field).setAttribute('aria-invalid', 'true');
    errorOf(field).hidden = false;
    setText(errorOf(field), message);
    fieldOf(field).focus();
  }

  private submit(): void {
    this.clearErrors();
    if (this.file) this.submitted(this.file, this.options);
  }

  private clearErrors(): void {
    for (const field of FILE_FIELDS) {
      fieldOf(field).removeAttribute('aria-invalid');
      errorOf(field).hidden = true;
      setText(errorOf(field), '');
    }
  }

  private get options(): FileOptions {
    const options = { ...NO_OPTIONS };
    for (const field of FILE_FIELDS) options[field] = fieldOf(field).value.trim();
    return options;
  }
}
