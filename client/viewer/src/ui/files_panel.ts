import { type FileInput, filesOfDrop, inspectFiles } from '../input/drop';
import { FieldError, type FileOptions, NO_OPTIONS } from '../input/options';
import { InputError, type FrameSource } from '../input/source';
import type { Settings } from '../stream/settings';
import { button, byId, input, make } from './dom';
import { FileForm } from './file_form';

/** Limit of closed files that are offered. Only recordings stay in memory. */
const MOST_CLOSED = 6;

/** A file that was opened, with its options. */
export interface OpenFile {
  input: FileInput;
  options: FileOptions;
  /** Settings and frame of a file that was closed. */
  settings?: Settings;
  sequence?: number | null;
}

export interface FilesEvents {
  opened(source: FrameSource, file: OpenFile): void;
  /** The form needs an answer of the user. */
  asks(): void;
  /** `isGone`: whether the cause of an error has gone. */
  report(text: string, isError: boolean, isGone?: () => boolean): void;
  /** Options of a file when it is first opened. */
  optionsOf(title: string): FileOptions;
}

/** Opens local files: dropped anywhere on the page, chosen, or closed before. */
export class FilesPanel {
  private readonly form: FileForm;
  private readonly closed: OpenFile[] = [];
  /** The file for which the form shows an error; null for none. */
  private asked: FileInput | null = null;

  constructor(private readonly events: FilesEvents) {
    this.form = new FileForm((file, options) => void this.open({ input: file, options }));
    button('choose-files').addEventListener('click', () => input('files').click());
    button('choose-folder').addEventListener('click', () => input('folder').click());
    for (const id of ['files', 'folder']) {
      input(id).addEventListener('change', () => {
        void this.inspect([...input(id).files ?? []]);
        input(id).value = '';
      });
    }
    this.listenForDrops();
  }

  /** Shows the options of the file in the chosen picture, or nothing. */
  show(file: OpenFile | null): void {
    this.asked = null;
    this.form.show(file?.input ?? null, file?.options ?? NO_OPTIONS);
  }

  addClosed(file: OpenFile): void {
    this.forget(file.input);
    this.closed.unshift(file);
    this.closed.length = Math.min(this.closed.length, MOST_CLOSED);
    this.listClosed();
  }

  private forget(file: FileInput): void {
    const at = this.closed.findIndex((one) => one.input === file);
    if (at >= 0) this.closed.splice(at, 1);
  }

  private listClosed(): void {
    byId('closed', HTMLElement).hidden = this.closed.length === 0;
    byId('closed-files', HTMLElement).replaceChildren(...this.closed.map((file) => {
      const reopen = make('button', { type: 'button', class: 'watch', title: 'Opens this file again.' }, file.input.title);
      reopen.addEventListener('click', () => void this.open(file));
      return make('li', {}, reopen);
    }));
  }

  private listenForDrops(): void {
    const { body } = document;
    const holdsFiles = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
    addEventListener('dragover', (event) => {
      if (!holdsFiles(event)) return;
      event.preventDefault();
      body.classList.add('dropping');
    });
    addEventListener('dragleave', (event) => {
      if (event.relatedTarget === null) body.classList.remove('dropping');
    });
    addEventListener('drop', (event) => {
      body.classList.remove('dropping');
      if (!event.dataTransfer || !holdsFiles(event)) return;
      event.preventDefault();
      void filesOfDrop(event.dataTransfer).then((files) => this.inspect(files));
    });
  }

  private async inspect(files: File[]): Promise<void> {
    if (files.length === 0) return;
    this.events.report('Reading files', false);
    try {
      const file = await inspectFiles(files);
      await this.open({ input: file, options: this.events.optionsOf(file.title) });
    } catch (error) {
      this.fail(error);
    }
  }

  /** Opens a file. If an option is missing or wrong, shows the form with the error. */
  private async open(file: OpenFile): Promise<void> {
    try {
      const source = await file.input.open(file.options);
      this.events.report('', false);
      this.asked = null;
      this.forget(file.input);
      this.listClosed();
      this.events.opened(source, file);
      this.form.show(file.input, file.options);
    } catch (error) {
      if (!(error instanceof FieldError)) return this.fail(error);
      this.form.show(file.input, file.options);
      this.events.asks();
      this.form.ask(error);
      this.asked = file.input;
      this.events.report(error.message, true, () => this.asked !== file.input);
    }
  }

  private fail(error: unknown): void {
    if (!(error instanceof InputError)) throw error;
    this.events.report(error.message, true);
  }
}
