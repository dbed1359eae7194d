import { ListStreamsRequestSchema, ListStreamsResponseSchema, type StreamSummary } from '@proto/v1/reconstruction_pb';
import type { Gateway } from '../stream/gateway';
import { CallError } from '../stream/status';
import { byId, input, make, setText } from './dom';
import { count } from './format';

const POLL_MS = 1500;

export interface StreamsEvents {
  watch(stream: string): void;
  beside(stream: string): void;
  /** The first list with streams. */
  first(streams: StreamSummary[]): void;
  failed(text: string): void;
  token(token: string): void;
}

interface Item { element: HTMLLIElement; details: HTMLElement; watch: HTMLButtonElement }

/** The list of live streams, polled. */
export class StreamsPanel {
  private readonly items = new Map<string, Item>();
  private shown: string[] = [];
  private isFirst = true;
  private timer: ReturnType<typeof setTimeout> | null = null;

  /** `isOwn`: whether this page produces the stream with this id. */
  constructor(private readonly gateway: Gateway, private readonly isOwn: (id: string) => boolean,
              private readonly events: StreamsEvents) {
    byId('token-form', HTMLFormElement).addEventListener('submit', (event) => {
      event.preventDefault();
      events.token(input('token').value.trim());
      void this.poll();
    });
    void this.poll();
  }

  /** Sets the names of the streams on the stage. */
  setShown(shown: string[]): void {
    this.shown = shown;
    for (const [name, item] of this.items) this.mark(name, item);
  }

  private async poll(): Promise<void> {
    if (this.timer !== null) clearTimeout(this.timer);
    try {
      await this.update();
    } catch (error) {
      if (!(error instanceof CallError)) throw error;
      if (error.status.reason.startsWith('TOKEN')) byId('access', HTMLDetailsElement).open = true;
      this.events.failed(error.message);
    }
    this.timer = setTimeout(() => void this.poll(), POLL_MS);
  }

  private async update(): Promise<void> {
    const { streams } = await this.gateway.call(
      '/v1/streams', ListStreamsRequestSchema, ListStreamsResponseSchema, { pageSize: 200 });
    this.show(streams.filter(({ streamId }) => !this.isOwn(streamId)));
    this.events.failed('');
    if (this.isFirst && streams.length > 0) {
      this.isFirst = false;
      this.events.first(streams);
    }
    setText(byId('server', HTMLElement), (await this.gateway.info()).version);
  }

  private show(streams: StreamSummary[]): void {
    const list = byId('streams', HTMLElement);
    const names = new Set(streams.map(({ streamName }) => streamName));
    for (const [name, item] of this.items) {
      if (names.has(name)) continue;
      item.element.remove();
      this.items.delete(name);
    }
    for (const stream of streams) {
      const item = this.items.get(stream.streamName) ?? this.add(stream.streamName, list);
      setText(item.details, `${count(Number(stream.frames))} frames, ${stream.watchers} watching`);
    }
    byId('no-streams', HTMLElement).hidden = streams.length > 0;
  }

  private add(name: string, list: HTMLElement): Item {
    const details = make('small');
    const watch = make('button', { type: 'button', class: 'watch', 'aria-label': `Watch ${name}` }, name, details);
    const beside = make('button', { type: 'button', 'aria-label': `Watch ${name} beside` }, '+');
    beside.title = 'Shows this stream beside the current pictures.';
    watch.title = 'Shows this stream in the chosen picture.';
    watch.addEventListener('click', () => this.events.watch(name));
    beside.addEventListener('click', () => this.events.beside(name));
    const item = { element: make('li', {}, watch, beside), details, watch };
    this.items.set(name, item);
    list.append(item.element);
    this.mark(name, item);
    return item;
  }

  private mark(name: string, { element, watch }: Item): void {
    const isShown = this.shown.includes(name);
    element.dataset.shown = String(isShown);
    watch.setAttribute('aria-pressed', String(isShown));
  }
}
