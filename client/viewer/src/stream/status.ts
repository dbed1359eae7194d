// How calls end, and what that means for whoever looks at the page.

/** The status of a call, as the server tells it in JSON. */
export interface CallStatus {
  /** Of gRPC; 0: well. */
  code: number;
  reason: string;
  message: string;
}

export const UNAVAILABLE = 14;
export const UNAUTHENTICATED = 16;

/** What to do about a reason, where it is not plain from its words. */
const ADVICE: Record<string, string> = {
  TOKEN_MISSING: 'Enter the access token and connect again.',
  TOKEN_UNKNOWN: 'This server does not know the access token. Enter another one.',
  NOT_PERMITTED: 'The access token does not allow this. Enter another one.',
  NO_SUCH_STREAM: 'No stream of this name is open. The page waits for it.',
  TOO_MANY_WATCHERS: 'The server has no place for another viewer. The page tries again.',
  TOO_MANY_STREAMS: 'The server has no place for another stream. The page tries again.',
  CALLER_WATCHERS: 'You watch as many streams as you may. Close another page.',
  FELL_BEHIND: 'This page was too slow for the stream. It goes on with the newest frame.',
  DRAINING: 'The server is going away. The page connects again.',
  MEMORY_BUDGET: 'The server has no memory for this now. Try again.',
  RESOLUTION: 'The frame is too wide for float32. Look at its coordinates.',
  NOT_PLANAR: 'The particles do not lie in one plane.',
  OUT_OF_RANGE: 'Change the setting that is named.',
};

/** Reasons that no second try can mend. */
const FINAL = new Set([
  'TOKEN_MISSING', 'TOKEN_UNKNOWN', 'NOT_PERMITTED', 'PROTOCOL', 'OUT_OF_RANGE', 'UNSUPPORTED',
  'NAME', 'LABELS', 'MALFORMED', 'OPEN_BYTES',
]);

/** Whether trying again can help. */
export function mayTryAgain(status: CallStatus): boolean {
  return !FINAL.has(status.reason) && status.code !== UNAUTHENTICATED;
}

/** One or two sentences: what happened, and what to do. */
export function inWords(status: CallStatus): string {
  const what = status.message || (status.reason ? `The server says ${status.reason}.` : '');
  const advice = ADVICE[status.reason] ?? '';
  return [what && !/[.!?]$/.test(what) ? `${what}.` : what, advice].filter(Boolean).join(' ');
}

/** A status from the server's JSON; null where the text is none. */
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

/** Thrown where a unary method fails. */
export class CallError extends Error {
  constructor(readonly status: CallStatus) {
    super(inWords(status));
  }
}
