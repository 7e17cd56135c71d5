// The desk: what is typed goes to the server as one act after the other, answers come back panel by panel.
import { Chart, layout, Shape, shade } from "rotorsim-desk";
import { theme } from "rotorsim-live";

const WINDOW = Math.random().toString(36).slice(2);
const CALM = 450; // ms without an edit after which films are asked for
const LOOK = 2000; // ms between two looks at the file and at what other windows did
const STORED = "rotorsim-desk-"; // names of what a browser keeps of the panels
const post = (path, content, keepalive = false) => fetch(path, { method: "POST", body: JSON.stringify(content), headers: { "content-type": "application/json" }, keepalive });

export default {
  template: `<div class="desk">
  <div v-if="over" class="desk-banner" role="alert">{{ over }}</div>
  <section v-if="state && state.starts" class="desk-starts" aria-label="begin">
    <h2>Begin with</h2>
    <div class="desk-cards">
      <button v-for="one in state.starts" :key="one.key" class="desk-card" @click="act('start', { key: one.key })"><b>{{ one.title }}</b><span>{{ one.text }}</span></button>
    </div>
    <h2>Open</h2>
    <div class="desk-open">
      <template v-if="state.files.length"><label>file of this folder <select v-model="chosenFile"><option value="" disabled>choose…</option><option v-for="one in state.files" :key="one">{{ one }}</option></select></label>
      <button :disabled="!chosenFile" @click="act('open', { name: chosenFile })">Open</button></template>
      <label>shipped machine <select v-model="chosenShipped"><option value="" disabled>choose…</option><option v-for="one in state.shipped" :key="one">{{ one }}</option></select></label>
      <button :disabled="!chosenShipped" @click="act('open', { name: chosenShipped })">Open a copy</button>
    </div>
  </section>
  <template v-if="state && state.groups">
  <div class="desk-bar" role="toolbar" aria-label="design">
    <span class="desk-file" data-file>{{ state.name }}<em data-saved>{{ state.saved ? "saved" : "not saved" }}</em></span>
    <button @click="act('undo')" :disabled="!state.undo" title="Ctrl+Z">Undo</button>
    <button @click="act('redo')" :disabled="!state.redo" title="Ctrl+Y">Redo</button>
    <button @click="act('save')" :disabled="state.saved" title="Ctrl+S">Save</button>
    <button @click="saveAs">Save as…</button>
    <button @click="act('keep')" title="compare with the design as it is now">Keep as A</button>
    <button v-if="state.kept" @click="act('swap')" title="edit A; the design that is here becomes A">Swap A and B</button>
    <button v-if="state.kept" @click="act('forget')">Forget A</button>
    <span class="desk-gap"></span>
    <label>up to <input class="desk-point" v-model="point.top" inputmode="decimal" aria-label="answers up to, rpm" placeholder="own" @input="asked" /> rpm</label>
    <label>modes at <input class="desk-point" v-model="point.speed" inputmode="decimal" aria-label="mode shapes at, rpm" placeholder="top" @input="asked" /> rpm</label>
    <label v-if="state.fed">supply <input class="desk-point" v-model="point.supply" inputmode="decimal" aria-label="supply pressure, MPa gauge" @input="asked" /> MPa</label>
    <label>tolerance <input class="desk-slide" type="range" min="1" :max="state.tolerance" step="1" v-model="point.tolerance" aria-label="tolerance, percent" @change="asked" /> {{ point.tolerance }} %</label>
    <span class="desk-gap"></span>
    <button @click="scripts('python')">as Python</button>
    <button @click="scripts('commands')">as commands</button>
    <a class="desk-button" :href="report" target="_blank" rel="noopener">Report</a>
    <button @click="runUp" :disabled="starting">{{ starting ? "starting…" : "Run it up" }}</button>
    <a v-if="rig" class="desk-button" :href="rig" target="_blank" rel="noopener">open the live rig</a>
  </div>
  <p v-if="pointWrong" class="desk-sentence" role="alert" data-point>{{ pointWrong }}</p>
  <div v-if="state.remark" class="desk-banner" role="status">{{ state.remark }}</div>
  <div v-if="state.unkept" class="desk-banner desk-wrong" role="alert">Edits are lost when the desk ends: {{ state.unkept }}. <button @click="saveAs">Save elsewhere…</button></div>
  <div v-if="sentence" class="desk-banner desk-wrong" role="alert">{{ sentence }} <button @click="sentence = ''">Close</button></div>
  <div v-if="state.changed || conflict" class="desk-banner desk-wrong" role="alert" data-conflict>{{ state.file }} was changed by somebody else.
    <button @click="act('take')">Take the file over</button> <button @click="act('save', { anyway: 'yes' })">Replace the file</button> <button @click="saveAs">Save elsewhere…</button></div>
  <div v-if="state.problems.length" class="desk-banner desk-wrong" role="alert">This file has faults; the last good design is drawn.
    <ul><li v-for="one in state.problems" :key="one">{{ one }}</li></ul></div>
  <div v-if="script" class="desk-banner desk-script"><pre data-script>{{ script }}</pre><button @click="copyScript">Copy</button> <button @click="script = ''">Close</button></div>
  <div class="desk-body">
    <nav class="desk-parts" aria-label="parts">
      <input ref="csv" type="file" accept=".csv,.tsv,.txt" hidden aria-label="CSV file with a bearing's table" @change="takeTable($event.target)" />
      <details v-for="group in state.groups" :key="group.key" :open="isOpen(group)" @toggle="opened[group.key] = $event.target.open">
        <summary>{{ group.title }}<span v-if="group.parts.length > 1 || group.add.length" class="desk-count">{{ group.parts.length }}</span></summary>
        <fieldset v-for="part in group.parts" :key="part.path" :class="{ 'desk-chosen': part.path === chosen }" :data-part="part.path" @focusin="chosen = part.path">
          <legend>{{ part.title }}</legend>
          <span class="desk-acts" v-if="part.many || part.path.startsWith('effects.')">
            <button v-if="part.path.startsWith('shaft.sections')" @click="act('split', { path: part.path })" :aria-label="'split ' + part.title">split</button>
            <button v-if="part.many && part.fields.some((one) => one.label === 'position')" @click="act('mirror', { path: part.path })" :aria-label="'mirror ' + part.title">mirror</button>
            <button v-if="part.many" @click="act('copy', { path: part.path })" :aria-label="'copy ' + part.title">copy</button>
            <button v-if="tabular(part)" @click="pickTable(part)" :aria-label="'table of a CSV file for ' + part.title">table</button>
            <button @click="act('delete', { path: part.path })" :aria-label="'delete ' + part.title">delete</button></span>
          <template v-for="field in shown(part)" :key="field.path">
            <div class="desk-field" :class="{ 'desk-unset': !field.set, 'desk-bad': wrong(field.path) }">
              <label :for="'f-' + field.path" :title="field.doc">{{ field.label }}</label>
              <select v-if="field.choices.length" :id="'f-' + field.path" :value="field.text" @change="typed(field, $event.target.value)"><option v-for="one in field.choices" :key="one">{{ one }}</option></select>
              <input v-else :id="'f-' + field.path" :data-path="field.path" :value="value(field)" :placeholder="field.holds" :inputmode="field.number ? 'decimal' : 'text'" autocomplete="off" spellcheck="false"
                :aria-invalid="Boolean(wrong(field.path))" :aria-describedby="'d-' + field.path" @input="typed(field, $event.target.value)" @focus="burst++" @keydown="step(field, $event)" />
              <span class="desk-unit">{{ field.unit }}</span>
              <p v-if="wrong(field.path)" :id="'d-' + field.path" class="desk-sentence" role="alert">{{ wrong(field.path) }}</p>
              <span v-else :id="'d-' + field.path" class="desk-hidden">{{ field.doc }}</span>
            </div>
          </template>
          <button v-if="part.fields.some((one) => !first(one))" class="desk-more" :aria-expanded="Boolean(more[part.path])" @click="more[part.path] = !more[part.path]">{{ more[part.path] ? "fewer" : "more fields" }}</button>
        </fieldset>
        <button v-for="one in group.add" :key="one.kind" class="desk-add" @click="act('add', { kind: one.kind })">add {{ one.text }}</button>
      </details>
    </nav>
    <main class="desk-main">
      <figure class="desk-view" ref="view"><svg v-if="drawn" :width="drawn.width" :height="drawn.height" role="img" :aria-label="'side view of ' + state.name">
        <g v-for="one in drawn.shapes" :key="'s' + one.key"><polygon :points="one.points" :class="['desk-' + one.kind, { 'desk-picked': one.part === chosen }]" :data-shape="one.part" @pointerdown="grab(one.part, $event)" /></g>
        <line :x1="drawn.start" :x2="drawn.end" :y1="drawn.middle" :y2="drawn.middle" class="desk-axis" />
        <g v-for="one in drawn.marks" :key="'m' + one.key" :transform="'translate(' + one.x + ',' + one.y + ')'" :class="['desk-mark', 'desk-' + one.kind, { 'desk-picked': one.part === chosen }]" :data-shape="one.part" @pointerdown="grab(one.part, $event)">
          <path :d="one.kind === 'spring' ? 'M0,1 l8,14 h-16 z' : one.kind === 'probe' ? 'M0,-8 l5,8 l-5,8 l-5,-8 z' : 'M0,-5 a5,5 0 1,0 .01,0 z'" /></g>
        <text v-for="one in drawn.diameters" :key="'d' + one.key" :x="one.x" :y="one.y - 4" class="desk-number">{{ one.text }}</text>
        <g v-for="row in drawn.rows" :key="row.name" class="desk-row"><text :x="row.ticks[0] - 8" :y="row.y + 4" text-anchor="end">{{ row.name }}</text>
          <line :x1="row.ticks[0]" :x2="row.ticks[row.ticks.length - 1]" :y1="row.y" :y2="row.y" /><line v-for="(x, k) in row.ticks" :key="k" :x1="x" :x2="x" :y1="row.y - 5" :y2="row.y + 5" />
          <text v-for="span in row.spans" :key="'t' + span.key" :x="span.x" :y="row.y - 4" text-anchor="middle">{{ span.text }}</text></g>
      </svg><figcaption>To scale; lengths in mm. Drag a disc, bearing or probe, or click it to find its fields.</figcaption></figure>
      <p v-if="Object.values(hidden).some(Boolean)" class="desk-hiddens">Hidden: <button v-for="one in state.panels.filter((p) => hidden[p.name])" :key="one.name" @click="hide(one.name, false)">{{ one.title }}</button></p>
      <div class="desk-panels">
        <figure v-for="one in panels" :key="one.name" :class="['desk-panel', { 'desk-large': large === one.name, 'desk-old': stale(one.name) }]" :data-panel="one.name" :data-slow="one.slow || null" :data-revision="revisions[one.name]">
          <figcaption><b>{{ one.title }}</b><span v-if="waiting[one.name]" class="desk-waiting" role="status">computing…</span>
            <button @click="pin(one.name)" :aria-pressed="Boolean(pinned[one.name])" :aria-label="'pin ' + one.title" title="first on the page and first computed">{{ pinned[one.name] ? "★" : "☆" }}</button>
            <button @click="enlarge(one.name)" :aria-label="(large === one.name ? 'shrink ' : 'enlarge ') + one.title">{{ large === one.name ? "⤡" : "⤢" }}</button>
            <button @click="hide(one.name, true)" :aria-label="'hide ' + one.title">×</button></figcaption>
          <p v-if="answers[one.name] && answers[one.name].error" class="desk-sentence" role="alert">{{ answers[one.name].error }}</p>
          <p v-if="unasked(one.name)" class="desk-note" data-large>{{ state.large }} <button @click="compute(one.name)" :aria-label="'compute ' + one.title">Compute</button></p>
          <canvas v-show="drawing(one.name)" :ref="(el) => hold(one.name, el)" role="img" :aria-label="one.title" @mousemove="cursor(one.name, $event.offsetX)" @mouseleave="cursor(one.name, null)"></canvas>
          <p v-if="drawing(one.name)" class="desk-legend"><span v-for="(c, k) in legend(one.name)" :key="k"><b v-if="c.sign" :style="{ color: c.colour }">{{ c.sign }} </b><i v-else :style="{ borderTop: (c.dash ? '3px dotted ' : '3px solid ') + c.colour }"></i>{{ c.name }}</span><span v-if="ghost(one.name)"><i class="desk-ghost"></i>{{ kept ? "design A" : "design before" }}</span></p>
          <canvas v-if="one.name === 'modes'" v-show="answers.modes?.shapes" class="desk-shape" ref="shape" role="img" aria-label="shaft in the mode that is chosen, moving; drag to turn it" @pointerdown="turn($event)"></canvas>
          <p v-if="answers[one.name]?.shapes" class="desk-legend"><button v-for="(row, k) in answers[one.name].rows" :key="k" :aria-pressed="mode === k" @click="mode = k">mode {{ k + 1 }}</button><button :aria-pressed="moving" @click="moving = !moving">{{ moving ? "stop" : "move" }}</button></p>
          <template v-if="answers[one.name]"><div class="desk-sides"><div class="desk-table" v-if="answers[one.name].rows && answers[one.name].rows.length"><table :data-table="one.name"><thead><tr><th v-for="head in answers[one.name].heads" :key="head" scope="col">{{ head }}</th></tr></thead>
            <tbody><tr v-for="(row, k) in answers[one.name].rows" :key="k" :class="verdict(row)"><td v-for="(cell, i) in row" :key="i">{{ cell }}</td></tr></tbody></table></div>
            <div class="desk-table" v-if="kept && kept[one.name]?.rows?.length"><table :data-kept="one.name"><thead><tr><th :colspan="kept[one.name].heads.length">design A</th></tr></thead>
            <tbody><tr v-for="(row, k) in kept[one.name].rows" :key="k" :class="verdict(row)"><td v-for="(cell, i) in row" :key="i">{{ cell }}</td></tr></tbody></table></div></div>
          <p v-for="note in answers[one.name].notes" :key="note" class="desk-note">{{ note }}</p></template>
        </figure>
      </div>
    </main>
  </div>
  </template></div>`,
  data: () => ({
    state: null, answers: {}, before: {}, revisions: {}, texts: {}, waiting: {}, refused: {}, point: { top: "", speed: "", supply: "0.5", tolerance: "5" },
    opened: {}, more: {}, hidden: stored("hidden"), pinned: stored("pinned"), requested: {}, large: "", chosen: "", sentence: "", conflict: false, script: "", rig: "", over: "",
    pointWrong: "", kept: null, mode: 0, moving: !window.matchMedia("(prefers-reduced-motion: reduce)").matches, starting: false, burst: 0, width: 800, chosenFile: "", chosenShipped: "", dark: false,
  }),
  computed: {
    panels() {
      const first = (one) => Number(Boolean(this.pinned[one.name]));
      return this.state.panels.filter((one) => !this.hidden[one.name]).sort((a, b) => first(b) - first(a));
    },
    drawn() {
      return this.state && this.state.view ? layout(this.state.view, this.width) : null;
    },
    report() {
      return `report?supply=${encodeURIComponent(this.point.supply)}`;
    },
  },
  async mounted() {
    this.charts = {};
    this.acts = [];
    this.last = "";
    this.seen = new Set();
    this.watch = new IntersectionObserver((entries) => {
      for (const one of entries) this.seen[one.isIntersecting ? "add" : "delete"](one.target.closest("[data-panel]")?.dataset.panel);
    });
    this.sizes = new ResizeObserver(() => this.resized());
    this.sizes.observe(this.$el);
    this.theme = new MutationObserver(() => { this.dark = document.body.classList.contains("body--dark"); this.redraw(); });
    this.theme.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.keys = (event) => this.shortcut(event);
    window.addEventListener("keydown", this.keys);
    this.leave = () => { // what still waits, in its order
      const acts = this.acts.splice(0);
      if (acts.length && !navigator.sendBeacon("desk", JSON.stringify({ acts }))) post("desk", { acts }, true).catch(() => {});
    };
    window.addEventListener("pagehide", this.leave);
    window.deskTimes = [];
    this.take(await (await fetch("desk")).json());
    this.timer = setInterval(() => this.look(), LOOK);
    this.shape = new Shape(() => this.drawShape());
  },
  unmounted() {
    clearInterval(this.timer);
    this.shape.end();
    window.removeEventListener("keydown", this.keys);
    window.removeEventListener("pagehide", this.leave);
    for (const one of [this.watch, this.sizes, this.theme]) one.disconnect();
  },
  methods: {
    // One act after the other; what was typed into a field meanwhile replaces what waits for it.
    async act(name, values = {}) {
      const next = { act: name, ...values }, last = this.acts.at(-1);
      if (name === "set" && last && last.act === "set" && last.path === next.path && last.burst === next.burst) this.acts.pop();
      this.acts.push(next);
      if (this.acting) return;
      this.acting = true;
      while (this.acts.length) {
        try {
          const sent = this.acts.shift(), answer = await (await post("desk", sent, sent.act === "set")).json();
          this.over = "";
          this.came(sent, answer);
        } catch {
          this.over = "The desk does not answer; what you type is not taken. Start rotorsim desk again and reload.";
          this.acts = [];
        }
      }
      this.acting = false;
    },
    came(sent, answer) {
      const refused = answer.refused;
      const group = sent.act === "set" ? `${sent.path} ${sent.burst}` : `${sent.act} ${answer.revision}`;
      if (!refused && !answer.conflict && group !== this.last) {
        for (const [name, one] of Object.entries(this.answers)) if (!one.first) this.before[name] = one;
        this.last = group;
      }
      for (const [path, one] of Object.entries(this.refused)) {
        if (this.acts.some((next) => next.act === "set" && next.path === path)) continue; // typed after what is answered here
        if (sent.act === "set" ? path === sent.path || (!refused && one.text === undefined) : !refused) delete this.refused[path];
      }
      this.conflict = Boolean(answer.conflict);
      this.sentence = "";
      if (refused && sent.act === "set") this.refused[sent.path] = { text: this.refused[sent.path]?.text ?? sent.text, sentence: refused.sentence };
      else if (refused) this.sentence = refused.sentence;
      if (refused?.field) this.pointAt(refused);
      if (answer.chosen) this.choose(answer.chosen);
      this.take(answer);
    },
    // An act that another field forbids is answered there too, until an act is accepted; nothing was typed there.
    pointAt({ field, reason }) {
      const part = this.state.groups?.flatMap((one) => one.parts).find((part) => part.fields.some((one) => one.path === field));
      if (!part) return;
      this.refused[field] = { sentence: reason };
      this.choose(part.path);
    },
    take(state) {
      const other = !this.state || this.state.revision !== state.revision || !state.groups !== !this.state.groups;
      this.know(state);
      if (!this.state?.groups) this.$nextTick(() => this.resized());
      for (const part of [state.groups, state.view]) if (part) Object.freeze(part); // as a whole replaced: Vue need not watch it
      this.state = state;
      if (other) this.requested = {};
      if (state.groups && other) this.ask();
    },
    async look() {
      if (this.acting || this.acts.length || document.hidden) return;
      try {
        const found = await (await fetch(`desk?known=${this.state.revision}`)).json();
        if (this.acting || this.acts.length || found.revision < this.state.revision) return; // an act was quicker
        if (found.groups || found.starts) this.take(found);
        else Object.assign(this.state, found);
        this.over = "";
      } catch {
        this.over = "The desk has ended; what you type is not taken. Start rotorsim desk again and reload.";
      }
    },
    asked() {
      if (this.kept) this.kept = {};
      this.texts = this.requested = {};
      clearTimeout(this.calm);
      this.calm = setTimeout(() => this.ask(), 150);
    },
    // Pinned panels come first, then those on view; those of films wait until nothing was typed for a moment.
    ask() {
      clearTimeout(this.calm);
      const names = this.panels.map((one) => one.name).filter((name) => !this.unasked(name)).sort((a, b) => this.place(a) - this.place(b));
      this.waiting = Object.fromEntries(names.map((name) => [name, true]));
      if (!this.state.films || this.state.large) return this.stream(names);
      const near = this.stream(["static"]), own = this.streaming;
      this.calm = setTimeout(async () => {
        await near; // a slow computer would be asked for it twice
        if (this.streaming === own) this.stream(names.filter((name) => this.waiting[name]));
      }, CALM);
      return near;
    },
    place(name) {
      return this.pinned[name] ? 0 : this.seen.has(name) ? 1 : 2;
    },
    async stream(names) {
      const kept = this.kept ? names.filter((name) => !this.kept[name]) : [];
      const content = { window: WINDOW, panels: names, kept, near: names.filter((name) => this.place(name) < 2), ...this.point };
      if (this.streaming) this.streaming.abort();
      const own = (this.streaming = new AbortController());
      try {
        const answer = await fetch("answers", { method: "POST", body: JSON.stringify(content), signal: own.signal });
        this.pointWrong = "";
        if (answer.headers.get("content-type") === "application/json") {
          this.pointWrong = (await answer.json()).error || "";
          for (const name of names) this.waiting[name] = false;
          return;
        }
        const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
        let text = "";
        for (;;) {
          const { value, done } = await reader.read();
          if (done) break;
          text += value;
          const lines = text.split("\n");
          text = lines.pop();
          for (const line of lines) this.answered(JSON.parse(line));
        }
        if (this.streaming === own && names.length > 1) for (const name of names) this.waiting[name] = false;
      } catch (error) {
        if (error.name !== "AbortError") this.over = "The desk does not answer.";
      }
    },
    answered({ revision, panel, answer, text }) {
      Object.freeze(answer); // Vue need not watch every number
      if (answer.first) return this.begun(panel, answer, text);
      if (this.kept && text === this.state.kept) {
        this.kept[panel] = answer;
        this.paint(panel);
        if (text !== this.state.text) return;
      }
      this.answers[panel] = answer.error && this.answers[panel] ? Object.freeze({ ...this.answers[panel], error: answer.error }) : answer;
      this.revisions[panel] = revision;
      this.texts[panel] = text;
      this.waiting[panel] = false;
      this.$nextTick(() => {
        this.paint(panel);
        const names = this.state.panels.filter((one) => !this.hidden[one.name] && !one.slow).map((one) => one.name);
        window.deskTimes.push({ panel, revision, typed: this.typedAt, drawn: performance.now(), all: names.every((name) => this.revisions[name] === this.state.revision) });
      });
    },
    // An answer in part: drawn unless the whole one of this design is there, with the panel still waiting.
    begun(panel, answer, text) {
      if (text !== this.state.text || this.texts[panel] === text) return;
      this.answers[panel] = answer;
      this.texts[panel] = "";
      this.$nextTick(() => {
        this.paint(panel);
        window.deskTimes.push({ panel, revision: this.state.revision, typed: this.typedAt, drawn: performance.now(), first: true, all: false });
      });
    },
    typed(field, text) {
      this.typedAt = performance.now();
      this.refused[field.path] = { text, sentence: this.refused[field.path]?.sentence || "" };
      this.act("set", { path: field.path, text, burst: String(this.burst) });
    },
    value(field) {
      return this.refused[field.path]?.text ?? field.text;
    },
    wrong(path) {
      return this.refused[path]?.sentence || this.state.at[path] || "";
    },
    // Arrows change the last digit that is written, with shift the one before.
    step(field, event) {
      if (event.key === "Escape" && this.refused[field.path]) delete this.refused[field.path];
      const by = { ArrowUp: 1, ArrowDown: -1 }[event.key], text = event.target.value || field.holds;
      if (!by || !field.number || !/^[+-]?\d+(\.\d+)?$/.test(text)) return;
      event.preventDefault();
      const digits = (text.split(".")[1] || "").length, size = 10 ** ((event.shiftKey ? 1 : 0) - digits);
      const next = (Number(text) + by * size).toFixed(digits);
      event.target.value = next;
      this.typed(field, next);
    },
    // What is shown at once of a part: what is written, but for the rows of a table over the speed.
    first(field) {
      return field.set && !field.path.includes(".points.");
    },
    shown(part) {
      const open = this.more[part.path];
      return part.fields.filter((one) => this.first(one) || open || this.wrong(one.path) || this.refused[one.path]);
    },
    isOpen(group) {
      return this.opened[group.key] ?? (group.open && group.parts.length + group.add.length > 0);
    },
    choose(path) {
      this.chosen = path;
      const group = this.state.groups.find((one) => one.parts.some((part) => part.path === path)) || this.state.groups.find((one) => path.startsWith(`${one.key}.`));
      if (group) this.opened[group.key] = true;
      this.$nextTick(() => this.$el.querySelector(`[data-part="${path}"]`)?.scrollIntoView({ block: "nearest" }));
    },
    tabular(part) {
      const kind = part.path.startsWith("bearings.") && part.fields.find((one) => one.label === "kind");
      return kind && ["linear", "table"].includes(kind.text);
    },
    pickTable(part) {
      this.tabulated = part.path;
      this.$refs.csv.click();
    },
    async takeTable(input) {
      const [file] = input.files, path = this.tabulated;
      if (file) this.act("table", { path, name: file.name, text: await file.text() });
      input.value = "";
    },
    // A drag moves the part by whole steps of the drawing; what waits is replaced, so nothing queues.
    grab(path, event) {
      this.choose(path);
      const field = this.state.groups.flatMap((one) => one.parts).find((one) => one.path === path)?.fields.find((one) => one.label === "position" && one.set);
      if (!field || !field.text) return;
      event.preventDefault();
      const burst = `drag ${++this.burst}`, from = event.clientX, begin = Number(field.text), size = { mm: 1, m: 1e-3, um: 1e3, cm: 0.1 }[field.unit];
      if (!size || Number.isNaN(begin)) return;
      const move = (now) => {
        const mm = (now.clientX - from) / this.drawn.scale, digits = Math.max(0, Math.ceil(Math.log10(this.drawn.scale)));
        const text = String(Number((begin + Number(mm.toFixed(digits)) * size).toPrecision(9)));
        this.typedAt = performance.now();
        if (text !== this.dragged) this.act("set", { path: field.path, text, burst });
        this.dragged = text;
      };
      const up = () => {
        window.removeEventListener("pointermove", move);
        this.dragged = null;
        delete this.refused[field.path];
      };
      window.addEventListener("pointermove", move);
      window.addEventListener("pointerup", up, { once: true });
    },
    shortcut(event) {
      if (!(event.ctrlKey || event.metaKey) || !this.state?.groups) return;
      const key = event.key.toLowerCase(), name = key === "z" ? (event.shiftKey ? "redo" : "undo") : { y: "redo", s: "save" }[key];
      if (!name) return;
      event.preventDefault();
      this.act(name);
    },
    // Answers of design A: those on view where A is the design that was on view, else the server is asked for them.
    know(state) {
      if ((state.kept || "") === (this.state?.kept || "")) return;
      const fresh = Object.keys(this.answers).filter((name) => state.kept === this.texts[name] && !this.waiting[name] && !this.answers[name].error);
      this.kept = state.kept ? Object.fromEntries(fresh.map((name) => [name, this.answers[name]])) : null;
      this.redraw();
    },
    ghost(name) {
      return (this.kept || this.before)[name];
    },
    drawShape() {
      const shapes = this.answers.modes?.shapes, canvas = [this.$refs.shape].flat()[0];
      if (shapes && canvas && this.seen.has("modes")) this.shape.draw(canvas, shapes, Math.min(this.mode, shapes.lines.length - 1), this.moving);
    },
    turn(event) {
      const canvas = event.target, move = (now) => this.shape.turn(now.movementX, now.movementY);
      canvas.setPointerCapture(event.pointerId);
      canvas.addEventListener("pointermove", move);
      canvas.addEventListener("pointerup", () => canvas.removeEventListener("pointermove", move), { once: true });
    },
    saveAs() {
      const name = window.prompt("Name of the file", this.state.name);
      if (name) this.act("save", { name });
    },
    async scripts(which) {
      const found = await (await post("scripts", this.point)).json();
      this.script = found.error || found[which];
    },
    copyScript() {
      navigator.clipboard?.writeText(this.script);
    },
    async runUp() {
      this.starting = true;
      const found = await (await post("run", {})).json();
      this.starting = false;
      this.sentence = found.error || "";
      this.rig = found.address || "";
      if (this.rig) window.open(this.rig, "_blank", "noopener");
    },
    hide(name, value) {
      this.hidden[name] = value;
      localStorage.setItem(`${STORED}hidden`, JSON.stringify(this.hidden));
      if (value) delete this.charts[name];
      else this.ask();
    },
    pin(name) {
      this.pinned[name] = !this.pinned[name];
      localStorage.setItem(`${STORED}pinned`, JSON.stringify(this.pinned));
      this.ask();
    },
    // A panel of a machine too large to be answered at once, which nobody asked for yet.
    unasked(name) {
      return Boolean(this.state.large) && !this.requested[name];
    },
    compute(name) {
      this.requested[name] = true;
      this.ask();
    },
    enlarge(name) {
      this.large = this.large === name ? "" : name;
      this.$nextTick(() => this.redraw());
    },
    stale(name) {
      return (this.waiting[name] || this.unasked(name)) && this.answers[name];
    },
    drawing(name) {
      return Boolean(this.answers[name]?.curves);
    },
    legend(name) {
      const colours = theme(this.dark); // read again when the page turns dark
      const alone = ({ y, marks }) => Boolean(marks) && y.every((v, k) => v === null || !k || y[k - 1] === null); // points without a line
      const sign = (one) => alone(one) && ({ f: "▲", b: "▼" }[one.marks[one.y.findIndex((v) => v !== null)]] || "●");
      const { curves, y } = this.answers[name], inside = (v) => v !== null && (!y.range || (v >= y.range[0] && v <= y.range[1]));
      return curves.filter((one) => one.colour >= 0 && one.y.some(inside)).slice(0, 10).map((one) => ({ name: one.name, colour: shade(colours, one.colour), dash: one.dash, sign: sign(one) }));
    },
    verdict(row) {
      const last = row.at(-1) || "";
      return last.includes("not met") ? "desk-missed" : last.includes("met") ? "desk-met" : "";
    },
    hold(name, canvas) {
      if (!canvas || this.charts?.[name]?.canvas === canvas) return;
      this.charts[name] = new Chart(canvas);
      this.watch.observe(canvas.closest("figure"));
    },
    cursor(name, x) {
      this.charts[name]?.again(x);
    },
    paint(name) {
      this.charts[name]?.draw(this.answers[name], this.ghost(name));
    },
    redraw() {
      for (const name of Object.keys(this.charts)) this.paint(name);
    },
    resized() {
      const width = this.$refs.view?.clientWidth;
      if (width && width !== this.width) this.width = width;
      this.$nextTick(() => this.redraw());
    },
  },
};

function stored(what) {
  try {
    return JSON.parse(localStorage.getItem(STORED + what)) || {};
  } catch {
    return {};
  }
}

