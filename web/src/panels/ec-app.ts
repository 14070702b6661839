import { LitElement, css, html, nothing } from "lit";
import { customElement, query, state } from "lit/decorators.js";

import { when } from "../common/format";
import { type Route, formatRoute, parseRoute } from "../common/route";
import { sharedStyles } from "../common/shared-styles";
import "../components/ec-problem";
import "../components/ec-request-dialog";
import type { EcRequestDialog } from "../components/ec-request-dialog";
import { listAssessments, setKey } from "../data/api";
import { asProblem } from "../data/problems";
import type { Assessment, AssessmentSummary, Problem } from "../data/types";
import "./ec-assessment-page";
import "./ec-estimate-page";
import "./ec-score-page";

/** The page: its header, and the view that the address names. */
@customElement("ec-app")
export class EcApp extends LitElement {
  @state() private route: Route = parseRoute(location.hash);
  @state() private assessments: AssessmentSummary[] | null = null;
  @state() private problem: Problem | null = null;
  @query("ec-request-dialog") private dialog!: EcRequestDialog;

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: block;
        min-height: 100vh;
      }
      header {
        display: flex;
        align-items: center;
        gap: 0.5rem 1.1rem;
        flex-wrap: wrap;
        padding: 0.55rem 1.2rem;
        background: var(--surface);
        border-bottom: 1px solid var(--line);
      }
      .brand {
        display: flex;
        align-items: center;
        gap: 0.5rem;
        font-weight: 660;
        font-size: 1.07rem;
        letter-spacing: -0.01em;
      }
      .brand img {
        width: 1.5rem;
        height: 1.5rem;
      }
      nav {
        display: flex;
        flex-wrap: wrap;
        gap: 0.2rem;
      }
      nav a {
        padding: 0.3rem 0.7rem;
        white-space: nowrap;
        border-radius: 7px;
        color: var(--ink-soft);
        text-decoration: none;
      }
      nav a[aria-current="page"] {
        background: var(--sunken);
        color: var(--ink);
        font-weight: 560;
      }
      .tools {
        margin-left: auto;
        display: flex;
        gap: 0.6rem;
        min-width: 0;
      }
      .tools select {
        max-width: 20rem;
        min-width: 0;
        text-overflow: ellipsis;
      }
      .welcome {
        max-width: 38rem;
        margin: 12vh auto;
        padding: 0 1.2rem;
        display: grid;
        gap: 0.9rem;
      }
      .welcome h1 {
        font-size: 1.5rem;
        letter-spacing: -0.015em;
      }
      code {
        background: var(--sunken);
        padding: 0.1rem 0.35rem;
        border-radius: 4px;
      }
      @media (max-width: 760px) {
        header {
          padding: 0.55rem 0.7rem;
        }
        nav {
          gap: 0;
        }
        nav a {
          padding: 0.3rem 0.45rem;
        }
        .tools {
          width: 100%;
        }
        .tools select {
          flex: 1;
        }
      }
    `,
  ];

  override connectedCallback(): void {
    super.connectedCallback();
    window.addEventListener("hashchange", this.#onHash);
    void this.#refresh();
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    window.removeEventListener("hashchange", this.#onHash);
  }

  override render() {
    return html`
      <header>
        <span class="brand"><img src="icon.svg" alt="" />Ergocast</span>
        <nav aria-label="Views">
          ${this.#link("Robot trajectories", "assessment")} ${this.#link("Recording", "recording")}
          ${this.#link("Forces and payload", "estimate")}
        </nav>
        ${this.route.page === "assessment" ? this.#tools() : nothing}
      </header>
      ${this.#view()}
      <ec-request-dialog @assessed=${this.#onAssessed}></ec-request-dialog>
    `;
  }

  #link(text: string, page: Route["page"]) {
    const targets: Record<Route["page"], Route> = {
      assessment: { page: "assessment", assessment: null, candidate: null },
      recording: { page: "recording" },
      estimate: { page: "estimate", estimate: null },
    };
    return html`<a
      href=${formatRoute(targets[page])}
      aria-current=${this.route.page === page ? "page" : nothing}
      >${text}</a
    >`;
  }

  #tools() {
    const shown = this.#assessmentId();
    return html`<div class="tools">
      ${
        this.assessments && this.assessments.length > 0
          ? html`<select
              aria-label="Assessment"
              @change=${(event: Event) =>
                this.#go({
                  page: "assessment",
                  assessment: (event.target as HTMLSelectElement).value,
                  candidate: null,
                })}
            >
              ${this.assessments.map(
                (item) =>
                  html`<option value=${item.id} ?selected=${item.id === shown}>
                    ${item.name ?? `${item.n_candidates} candidates`}, ${when(item.created)}
                  </option>`,
              )}
            </select>`
          : nothing
      }
      <button @click=${() => this.dialog.open()}>Open request…</button>
    </div>`;
  }

  #view() {
    if (this.problem?.status === 401) return this.#keyForm();
    if (this.route.page === "recording") return html`<ec-score-page></ec-score-page>`;
    if (this.route.page === "estimate") {
      return html`<ec-estimate-page
        .estimateId=${this.route.estimate}
        @estimate-select=${(event: CustomEvent<string | null>) =>
          this.#go({ page: "estimate", estimate: event.detail })}
      ></ec-estimate-page>`;
    }
    const assessment = this.#assessmentId();
    if (assessment !== null) {
      return html`<ec-assessment-page
        .assessmentId=${assessment}
        .candidateId=${this.route.candidate}
        @candidate-select=${(event: CustomEvent<string>) =>
          this.#go({ page: "assessment", assessment, candidate: event.detail })}
      ></ec-assessment-page>`;
    }
    if (this.problem) {
      return html`<div class="welcome"><ec-problem .problem=${this.problem}></ec-problem></div>`;
    }
    if (this.assessments === null) return nothing;
    return html`<div class="welcome">
      <h1>Which robot motion loads the person least?</h1>
      <p>
        Nothing has been assessed yet. Open a request, or run <code>ergocast demo</code> to see one
        on a made-up operator.
      </p>
      <p><button class="primary" @click=${() => this.dialog.open()}>Open request…</button></p>
    </div>`;
  }

  #keyForm() {
    return html`<form
      class="welcome"
      @submit=${(event: Event) => {
        event.preventDefault();
        const key = new FormData(event.target as HTMLFormElement).get("key");
        if (typeof key !== "string" || key.trim() === "") return;
        setKey(key.trim());
        void this.#refresh();
      }}
    >
      <h1>This service asks for a key</h1>
      <p class="soft">Whoever runs it can give you one. It is kept in this tab only.</p>
      <input type="password" name="key" aria-label="Key" autocomplete="off" required />
      <p><button class="primary">Continue</button></p>
    </form>`;
  }

  #assessmentId(): string | null {
    if (this.route.page !== "assessment") return null;
    return this.route.assessment ?? this.assessments?.[0]?.id ?? null;
  }

  #go(route: Route): void {
    const hash = formatRoute(route);
    // Choosing a candidate should not fill the history with steps to go back through.
    if (route.page === "assessment" && route.candidate !== null) {
      history.replaceState(null, "", hash);
      this.#onHash();
    } else location.hash = hash;
  }

  #onHash = (): void => {
    this.route = parseRoute(location.hash);
  };

  async #refresh(): Promise<void> {
    try {
      this.assessments = (await listAssessments()).items;
      this.problem = null;
    } catch (cause) {
      this.problem = asProblem(cause);
    }
  }

  async #onAssessed(event: CustomEvent<Assessment>): Promise<void> {
    await this.#refresh();
    this.#go({ page: "assessment", assessment: event.detail.id, candidate: null });
  }
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-app": EcApp;
  }
}
