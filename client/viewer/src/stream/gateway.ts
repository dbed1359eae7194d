import { create, fromBinary, toBinary, type DescMessage, type MessageInitShape, type MessageShape }
  from '@bufbuild/protobuf';
import {
  GetServerInfoRequestSchema, GetServerInfoResponseSchema, type DoubtText,
  type GetServerInfoResponse,
} from '@proto/v1/reconstruction_pb';
import { CallError, parseStatus, sentence, UNAVAILABLE, type CallStatus } from './status';

const PROTOCOL = 'partiemc.v1';

const LOST: CallStatus = {
  code: UNAVAILABLE, reason: '', message: 'The server does not respond',
};

/** Events of a channel. `ended` is the last one. */
export interface ChannelEvents {
  opened(): void;
  message(bytes: Uint8Array): void;
  ended(status: CallStatus): void;
}

/** A streaming call. A binary message is one serialised request or response. */
export class Channel {
  private readonly socket: WebSocket;
  private isOver = false;
  private status: CallStatus | null = null;

  constructor(url: URL, protocols: string[], private readonly events: ChannelEvents) {
    this.socket = new WebSocket(url, protocols);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => { if (!this.isOver) events.opened(); };
    this.socket.onmessage = (event: MessageEvent<ArrayBuffer | string>) => this.receive(event.data);
    this.socket.onclose = (event) => this.closed(event);
  }

  send<T extends DescMessage>(schema: T, request: MessageInitShape<T>): void {
    if (this.socket.readyState !== WebSocket.OPEN) return;
    this.socket.send(toBinary(schema, create(schema, request)) as Uint8Array<ArrayBuffer>);
  }

  /** Sent bytes that have not left this machine. */
  get unsentBytes(): number { return this.socket.bufferedAmount; }

  /** Half-closes the call: no request follows. Responses still arrive. */
  halfClose(): void {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send('end');
  }

  /** Cancels the call without calling `ended`. */
  close(): void {
    this.isOver = true;
    this.socket.close();
  }

  private receive(data: ArrayBuffer | string): void {
    if (this.isOver) return;
    if (typeof data === 'string') this.status = parseStatus(data);
    else this.events.message(new Uint8Array(data));
  }

  private closed(event: CloseEvent): void {
    if (this.isOver) return;
    this.isOver = true;
    const code = event.code >= 4000 ? event.code - 4000 : event.code === 1000 ? 0 : UNAVAILABLE;
    this.events.ended(this.status ?? (code === UNAVAILABLE ? LOST : { ...LOST, code, message: '' }));
  }
}

/** base64url without padding, of the text in UTF-8. */
function base64Url(text: string): string {
  const bytes = new TextEncoder().encode(text);
  return btoa(String.fromCharCode(...bytes))
    .replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

/** The server's gateway: unary methods by POST, streams by WebSocket. */
export class Gateway {
  token = '';
  private known: Promise<GetServerInfoResponse> | null = null;
  private doubts: DoubtText[] = [];

  /** `base`: address of the page's server. */
  constructor(private readonly base: URL) {}

  open(path: '/v1/watch' | '/v1/reconstruct', events: ChannelEvents): Channel {
    const url = new URL(path, this.base);
    url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
    const bearer = this.token ? [`bearer.${base64Url(this.token)}`] : [];
    return new Channel(url, [PROTOCOL, ...bearer], events);
  }

  /** Information on the server. Keeps the answer; after an error, the next call asks again. Throws CallError. */
  info(): Promise<GetServerInfoResponse> {
    this.known ??= this.call('/v1/info', GetServerInfoRequestSchema, GetServerInfoResponseSchema, {})
      .then((info) => {
        this.doubts = info.doubts;
        return info;
      })
      .catch((error: unknown) => {
        this.known = null;
        throw error;
      });
    return this.known;
  }

  /** The server's text on a doubt, a suspicion about the input. Until `info` is answered: `Doubt` and its number. */
  doubtText(doubt: number): string {
    return sentence(this.doubts.find((one) => one.doubt === doubt)?.explanation ?? `Doubt ${doubt}`);
  }

  /** Calls a unary method. Throws CallError. */
  async call<Q extends DescMessage, R extends DescMessage>(
    path: '/v1/info' | '/v1/streams' | '/v1/frame', requestSchema: Q, responseSchema: R,
    request: MessageInitShape<Q>,
  ): Promise<MessageShape<R>> {
    const response = await this.post(path, toBinary(requestSchema, create(requestSchema, request)));
    const body = new Uint8Array(await response.arrayBuffer());
    if (response.ok) return fromBinary(responseSchema, body);
    const status = parseStatus(new TextDecoder().decode(body));
    throw new CallError(status ?? { ...LOST, message: `The server responds with HTTP status ${response.status}` });
  }

  private async post(path: string, body: Uint8Array): Promise<Response> {
    const headers: Record<string, string> = { 'Content-Type': 'application/x-protobuf' };
    if (this.token) headers.Authorization = `Bearer ${this.token}`;
    try {
      return await fetch(new URL(path, this.base), {
        method: 'POST', headers, body: body as Uint8Array<ArrayBuffer>,
      });
    } catch {
      throw new CallError(LOST);
    }
  }
}
