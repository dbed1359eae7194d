import { filesOfDrop, openDropped } from '../input/drop';
import { InputError, type FrameSource } from '../input/source';
import { button, input } from './dom';

/** Opens local files: dropped anywhere on the page, or chosen. */
export class FilesPanel {
  constructor(private readonly opened: (source: FrameSource) => void,
              private readonly report: (text: string, isError: boolean) => void) {
    button('choose-files').addEventListener('click', () => input('files').click());
    button('choose-folder').addEventListener('click', () => input('folder').click());
    for (const id of ['files', 'folder']) {
      input(id).addEventListener('change', () => {
        void this.open([...input(id).files ?? []]);
        input(id).value = '';
      });
    }
    this.listenForDrops();
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
      void filesOfDrop(event.dataTransfer).then((files) => this.open(files));
    });
  }

  private async open(files: File[]): Promise<void> {
    if (files.length === 0) return;
    this.report('Reading files', false);
    try {
      const source = await openDropped(files);
      this.report('', false);
      this.opened(source);
    } catch (error) {
      if (!(error instanceof InputError)) throw error;
      this.report(error.message, true);
    }
  }
}
