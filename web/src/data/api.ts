/** Every request of the page. Paths are relative, so that it works behind a prefix. */
import { ProblemError, problemOf } from "./problems";
import type { EstimateItem, EstimateRequest, EstimateSummary, SeriesPart } from "./estimate-types";
import type {
  Assessment,
  AssessmentSummary,
  Items,
  ModelSummary,
  Operation,
  Posture,
  RecordingSummary,
  ScoreRequest,
  ScoreResult,
} from "./types";

const POLL_MS = 500;
/** Where the key of a service that asks for one is kept: in this tab, until it is closed. */
const KEY = "ergocast-api-key";

/** Takes the key that every later request carries. */
export function setKey(key: string): void {
  sessionStorage.setItem(KEY, key);
}

function withKey(init: RequestInit = {}): RequestInit {
  const key = sessionStorage.getItem(KEY);
  if (key === null) return init;
  const headers = new Headers(init.headers);
  headers.set("authorization", `Bearer ${key}`);
  return { ...init, headers };
}

async function request(path: string, init?: RequestInit): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(path, withKey(init));
  } catch (cause) {
    if (cause instanceof DOMException && cause.name === "AbortError") throw cause;
    throw new ProblemError({
      type: "about:blank",
      title: "The service cannot be reached",
      status: 0,
      detail: "Check that `ergocast serve` is running, then reload this page.",
    });
  }
  if (!response.ok) throw new ProblemError(await problemOf(response));
  return response;
}

async function json<T>(path: string, init?: RequestInit): Promise<T> {
  return (await (await request(path, init)).json()) as T;
}

const id = encodeURIComponent;

/** The service's own links start with a slash; the page keeps to its own folder. */
const local = (url: string): string => url.replace(/^\//, "");

export const listAssessments = () => json<Items<AssessmentSummary>>("v1/assessments");

export const getAssessment = (assessment: string, signal?: AbortSignal) =>
  json<Assessment>(`v1/assessments/${id(assessment)}`, { signal: signal ?? null });

export const getPosture = (assessment: string, candidate: string, signal?: AbortSignal) =>
  json<Posture>(`v1/assessments/${id(assessment)}/candidates/${id(candidate)}/posture`, {
    signal: signal ?? null,
  });

export const getModel = (model: string) => json<ModelSummary>(`v1/models/${id(model)}`);

export const modelUrdfUrl = (model: string) => `v1/models/${id(model)}/urdf`;

export const getText = async (url: string) => (await request(local(url))).text();

export const listRecordings = () => json<Items<RecordingSummary>>("v1/recordings");

/** Sends a file as it is; the same bytes get the same id. */
export const addRecording = (file: File) =>
  json<RecordingSummary>(`v1/recordings?name=${id(file.name)}`, {
    method: "POST",
    headers: { "content-type": "application/octet-stream" },
    body: file,
  });

/** Adds a file to a recording; one of the same role is replaced. */
export const addRecordingFile = (recording: string, role: string, file: File) =>
  json<RecordingSummary>(
    `v1/recordings/${id(recording)}/files?role=${id(role)}&name=${id(file.name)}`,
    { method: "POST", headers: { "content-type": "application/octet-stream" }, body: file },
  );

/** Waits until the next look at an operation, or until it is to be stopped. */
const pause = (signal?: AbortSignal) =>
  new Promise<void>((resolve) => {
    setTimeout(resolve, POLL_MS);
    signal?.addEventListener("abort", () => resolve(), { once: true });
  });

/**
 * Posts JSON and returns the result. Where the service answers 202, follows the operation, calling
 * `onProgress` with a fraction and a message, until its result can be fetched. When `signal` aborts,
 * the service is asked to stop the work, and what it then says of it is thrown.
 */
async function postJson<T>(
  path: string,
  body: string,
  onProgress: (fraction: number | null, message: string) => void = () => undefined,
  signal?: AbortSignal,
): Promise<T> {
  const response = await request(path, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body,
  });
  if (response.status !== 202) return (await response.json()) as T;
  const location = response.headers.get("location");
  if (location === null) {
    throw new ProblemError({
      type: "about:blank",
      title: "The service took the work but did not say where to follow it",
      status: 202,
    });
  }
  let stopping = false;
  for (;;) {
    if (signal?.aborted && !stopping) {
      stopping = true;
      // Work that has just ended cannot be stopped any more; how it ended is read below.
      await request(`${local(location)}/cancel`, { method: "POST" }).catch(() => undefined);
    }
    const operation = await json<Operation>(local(location));
    if (operation.state === "succeeded" && operation.result_url) {
      return json<T>(local(operation.result_url));
    }
    if (operation.problem) throw new ProblemError(operation.problem);
    if (operation.state === "failed" || operation.state === "cancelled") {
      throw new ProblemError({
        type: "about:blank",
        title: `The work was ${operation.state === "failed" ? "not finished" : "cancelled"}`,
        status: 0,
      });
    }
    const { done, total, message } = operation.progress ?? {};
    onProgress(done !== undefined && total ? done / total : null, message ?? operation.state);
    await pause(stopping ? undefined : signal);
  }
}

export const createAssessment = (
  text: string,
  onProgress?: (fraction: number | null, message: string) => void,
) => postJson<Assessment>("v1/assessments", text, onProgress);

export const createScore = (
  body: ScoreRequest,
  onProgress?: (fraction: number | null, message: string) => void,
) => postJson<ScoreResult>("v1/scores", JSON.stringify(body), onProgress);

export const listEstimates = () => json<Items<EstimateItem>>("v1/estimates");

export const getEstimate = (estimate: string, signal?: AbortSignal) =>
  json<EstimateSummary>(`v1/estimates/${id(estimate)}`, { signal: signal ?? null });

export const createEstimate = (
  body: EstimateRequest,
  onProgress?: (fraction: number | null, message: string) => void,
  signal?: AbortSignal,
) => postJson<EstimateSummary>("v1/estimates", JSON.stringify(body), onProgress, signal);

/** Columns of an estimate's time series; the service thins very long ones. */
export const getSeries = (estimate: string, columns: readonly string[], signal?: AbortSignal) =>
  json<SeriesPart>(`v1/estimates/${id(estimate)}/series?columns=${columns.map(id).join(",")}`, {
    signal: signal ?? null,
  });

export const parquetUrl = (estimate: string) => `v1/estimates/${id(estimate)}/series.parquet`;

/** Whether a link alone is refused, since it cannot carry the key. */
export const needsKey = () => sessionStorage.getItem(KEY) !== null;

export const getParquet = async (estimate: string) => (await request(parquetUrl(estimate))).blob();
