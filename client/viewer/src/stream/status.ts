/** Status of a call, from the server's JSON. */
export interface CallStatus {
  /** gRPC code; 0: OK. */
  code: number;
  reason: string;
  /** Describes the error and a remedy. */
  message: string;
}

export const UNAVAILABLE = 14;
export const UNAUTHENTICATED = 16;

/** The next step of the user or the page, by reason. The server's message describes the error itself. */
const NEXT_STEPS: Record<string, string> = {
  TOKEN_MISSING: 'Enter an access token.',
  TOKEN_UNKNOWN: 'Enter another access token.',
  NOT_PERMITTED: 'Enter another access token.',
  CALLER_WATCHERS: 'Close another page.',
  FELL_BEHIND: 'The page continues with the newest frame.',
};

/** Reasons that a retry cannot fix. */
const FINAL = new Set([
  'TOKEN_MISSING', 'TOKEN_UNKNOWN', 'NOT_PERMITTED', 'PROTOCOL', 'OUT_OF_RANGE', 'UNSUPPORTED',
  'NAME', 'LABELS', 'MALFORMED', 'OPEN_BYTES',
]);

export function mayRetry(status: CallStatus): boolean {
  return !FINAL.has(status.reason) && status.code !== UNAUTHENTICATED;
}

/** Adds a capital letter and a full stop. Names such as `open.fill` stay as they are. */
export function sentence(text: string): string {
  const start = /^[a-z]+[ ,]/.test(text) ? text[0].toUpperCase() + text.slice(1) : text;
  return start === '' || /[.!?]$/.test(start) ? start : `${start}.`;
}

/** The server's message and the next step. */
export function describe(status: CallStatus): string {
  const message = status.message || (status.reason ? `The server reports ${status.reason}` : '');
  return [sentence(message), NEXT_STEPS[status.reason] ?? ''].filter(Boolean).join(' ');
}

/** Parses a status from the server's JSON; null if the text is not a status. */
export function parseStatus(text: string): CallStatus | null {
  try {
    const value: unknown = JSON.parse(text);
    if (typeof value !== 'object' || value === null) return null;
    const fields = value as Record<string, unknown>;
    if (typeof fields.code !== 'number') return null;
    return {
      code: fields.code,
      reason: typeof fields.reason === 'string' ? fields.reason : '',
      message: typeof fields.message === 'string' ? fields.message : '',
    };
  } catch {
    return null;
  }
}

/** Error of a unary method. */
export class CallError extends Error {
  constructor(readonly status: CallStatus) {
    super(describe(status));
  }
}
