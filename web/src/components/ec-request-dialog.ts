import { LitElement, css, html, nothing } from "lit";
import { customElement, query, state } from "lit/decorators.js";

import { sharedStyles } from "../common/shared-styles";
import { createAssessment } from "../data/api";
import { asProblem } from "../data/problems";
import type { Problem } from "../data/types";
import "./ec-file-drop";
import "./ec-problem";

/**
 * Takes an assessment request as JSON, sends it, and shows what is wrong with it.
 *
 * @fires assessed `detail` is the new assessment.
 */
@customElement("ec-request-dialog")
export class EcRequestDialog extends LitElement {
  @state() private text = "";
  @state() private problem: Problem | null = null;
  @state() private busy = false;
  @state() private progress = "";
  @query("dialog") private dialog!: HTMLDialogElement;

  static override styles = [
    sharedStyles,
    css`
      dialog {
        width: min(44rem, calc(100vw - 2rem));
        max-height: calc(100vh - 3rem);
        border: 1px solid var(--line);
        border-radius: 12px;
        background: var(--surface);
        color: var(--ink);
        padding: 1.2rem;
      }
      dialog::backdrop {
        background: rgb(10 16 22 / 0.45);
      }
      .stack {
        display: grid;
        gap: 0.8rem;
      }
      h2 {
        font-size: 1.1rem;
      }
      textarea {
        width: 100%;
        min-height: 11rem;
        resize: vertical;
        font-family: ui-monospace, "DejaVu Sans Mono", monospace;
        font-size: 0.86rem;
        background: var(--sunken);
        border: 1px solid var(--line);
        border-radius: 8px;
        padding: 0.6rem;
      }
      .actions {
        display: flex;
        gap: 0.6rem;
        align-items: center;
        justify-content: flex-end;
      }
    `,
  ];

  open(): void {
    this.problem = null;
    this.progress = "";
    this.dialog.showModal();
  }

  override render() {
    return html`
      <dialog aria-labelledby="title" @keydown=${(event: Event) => event.stopPropagation()}>
        <div class="stack">
          <h2 id="title">Assess robot trajectories</h2>
          <p class="soft">
            A request as JSON: the operator's model, the start posture, the load and the candidate
            paths.
          </p>
          <ec-file-drop
            label="Drop a request file here, or choose one"
            accept=".json,application/json"
            @file-chosen=${this.#onFile}
          ></ec-file-drop>
          <textarea
            aria-label="Request as JSON"
            spellcheck="false"
            placeholder='{"model_id": "…", "hand": "right", "candidates": […]}'
            .value=${this.text}
            @input=${(event: Event) => {
              this.text = (event.target as HTMLTextAreaElement).value;
            }}
          ></textarea>
          ${this.problem ? html`<ec-problem .problem=${this.problem}></ec-problem>` : nothing}
          <div class="actions">
            <span class="soft small" role="status">${this.progress}</span>
            <button @click=${() => this.dialog.close()}>Close</button>
            <button
              class="primary"
              ?disabled=${this.busy || this.text.trim() === ""}
              @click=${this.#send}
            >
              Assess
            </button>
          </div>
        </div>
      </dialog>
    `;
  }

  async #onFile(event: CustomEvent<File>): Promise<void> {
    this.text = await event.detail.text();
    await this.#send();
  }

  async #send(): Promise<void> {
    this.problem = null;
    try {
      JSON.parse(this.text);
    } catch (cause) {
      this.problem = {
        type: "about:blank",
        title: "This is not JSON",
        status: 0,
        detail: cause instanceof Error ? cause.message : String(cause),
      };
      return;
    }
    this.busy = true;
    this.progress = "Assessing…";
    try {
      const assessment = await createAssessment(this.text, (fraction, message) => {
        this.progress = fraction === null ? message : `${Math.round(100 * fraction)} %, ${message}`;
      });
      this.dialog.close();
      this.dispatchEvent(new CustomEvent("assessed", { detail: assessment }));
    } catch (cause) {
      this.problem = asProblem(cause);
    } finally {
      this.busy = false;
      this.progress = "";
    }
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-request-dialog": EcRequestDialog;
  }
}
