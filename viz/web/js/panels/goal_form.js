// The fields of a goal as a form; core/goal_values.js converts their values.
import { isOneText, problemOf, problemText, toState } from "#core/goal_values.js";
import { fieldValue, html } from "#panels/html.js";

const MOST_ROWS = 200; // of an array
const FEW = 4; // numbers that can share a line

/**
 * The properties of all parts of the form; `state` is changed in place.
 * @typedef {{
 *   path: string, problems: FieldProblem[], disabled: boolean, onChange: () => void,
 * }} Shared
 */

/** @param {Partial<Shared> & Omit<Shared, "path"> & { fields: FormField[], state: Record<string, any> }} props */
export function Fields({ fields, path = "$", ...shared }) {
  return html`${fields.map(
    (field) => html`<${Field} key=${field.name} field=${field} path=${`${path}.${field.name}`} ...${shared} />`,
  )}`;
}

/** @param {Shared & { field: FormField, state: Record<string, any> }} props */
function Field({ field, state, ...shared }) {
  const { path, problems, onChange } = shared;
  const value = state[field.name];
  const put = (/** @type {any} */ changed) => {
    state[field.name] = changed;
    onChange();
  };
  if (field.array && !isOneText(field)) return html`<${Rows} field=${field} value=${value} put=${put} ...${shared} />`;
  if (field.kind === "message") return html`<${Group} field=${field} name=${field.name} state=${value} ...${shared} />`;
  const problem = problemOf(problems, path, field);
  return html`<div class=${`field ${problem ? "bad" : ""}`}>
    <label for=${path}>${field.name}</label><${Type} field=${field} />
    <${Input} field=${field} value=${value} put=${put} bad=${Boolean(problem)} ...${shared} />
    <${Comment} field=${field} path=${path} />
    <${Problem} path=${path} text=${problem && problemText(problem, value)} /></div>`;
}

/** @param {{ field: FormField }} props */
const Type = ({ field }) => html`<span class="type">${field.type}</span>`;

/** @param {{ field: FormField, path: string }} props */
function Comment({ field, path }) {
  const unit = { time: "seconds, or now", duration: "seconds" }[field.base];
  const notes = [field.comment, isOneText(field) && "separated by commas", unit].filter(Boolean);
  return notes.length ? html`<small class="comment" id=${`${path}?`}>${notes.join("; ")}</small>` : null;
}

/** @param {{ path: string, text: string | null }} props */
const Problem = ({ path, text }) => (text ? html`<p class="problem" id=${`${path}!`}>${text}</p>` : null);

/**
 * @param {{
 *   field: FormField, path: string, value: any, put: (value: any) => void, bad: boolean, disabled: boolean,
 *   label?: string,
 * }} props
 */
function Input({ field, path, value, put, bad, disabled, label }) {
  const isNumber = field.kind === "float" || field.kind === "integer";
  const shared = {
    id: path,
    disabled,
    "data-path": path,
    "aria-invalid": bad,
    "aria-label": label,
    "aria-describedby": `${path}? ${path}!`,
  };
  const onCheck = (/** @type {Event} */ e) => put(/** @type {HTMLInputElement} */ (e.target).checked);
  if (field.kind === "bool" && !field.array)
    return html`<input type="checkbox" ...${shared} checked=${String(value) === "true"} onChange=${onCheck} />`;
  const input = html`<input type="text" ...${shared} value=${value} spellcheck=${false} autocomplete="off"
    inputmode=${isNumber ? "decimal" : undefined} class=${field.kind === "string" ? "" : "number-input"}
    placeholder=${field.array ? "empty" : ""} onInput=${(/** @type {Event} */ e) => put(fieldValue(e))} />`;
  if (!field.choices.length || field.array) return input;
  return html`<span class="choice"><${Constants} field=${field} value=${value} put=${put} disabled=${disabled} />
    ${input}</span>`;
}

/**
 * A choice of the constants that are meant for a field.
 * @param {{ field: FormField, value: any, put: (value: any) => void, disabled: boolean }} props
 */
function Constants({ field, value, put, disabled }) {
  const text = String(value).trim();
  const isKnown = field.choices.some((choice) => choice.value === text);
  const onChange = (/** @type {Event} */ e) => {
    if (fieldValue(e) !== "") put(fieldValue(e));
  };
  return html`<select aria-label=${`constants for ${field.name}`} disabled=${disabled} value=${isKnown ? text : ""}
    onChange=${onChange}>
    ${!isKnown && html`<option value="">another value</option>`}
    ${field.choices.map((choice) => {
      const comment = choice.comment ? ` \u2013 ${choice.comment}` : "";
      const text = `${choice.name} = ${choice.value}${comment}`;
      return html`<option value=${choice.value} title=${choice.comment}>${text}</option>`;
    })}
  </select>`;
}

/**
 * A message inside the goal; a few numbers, such as a point, share a line.
 * @param {Shared & { field: FormField, name: string, state: Record<string, any>, after?: any }} props
 */
function Group({ field, name, state, after, ...shared }) {
  const isFew = field.fields.length <= FEW && field.fields.every((one) => one.kind === "float" && !one.array);
  const comment = field.comment || field.about;
  return html`<fieldset class=${`group-field ${isFew ? "few" : ""}`}>
    <legend>${name} <${Type} field=${field} />${after}</legend>
    ${comment && html`<small class="comment">${comment}</small>`}
    <${Problem} path=${shared.path} text=${problemOf(shared.problems, shared.path)} />
    <div class="inside-group"><${Fields} fields=${field.fields} state=${state} ...${shared} /></div>
    ${!field.fields.length && html`<small class="comment">no fields</small>`}</fieldset>`;
}

/**
 * An array of texts or messages, with a row for each.
 * @param {Shared & { field: FormField, value: any[], put: (value: any[]) => void }} props
 */
function Rows({ field, value, put, ...shared }) {
  const { path, problems, disabled } = shared;
  const isFixed = field.array?.length != null;
  const add = () => put([...value, field.kind === "message" ? toState(field.fields, field.default) : ""]);
  const remove = (/** @type {number} */ i) =>
    html`<button type="button" class="small" disabled=${disabled} aria-label=${`remove ${field.name} ${i + 1}`}
      onClick=${() => put(value.filter((_, n) => n !== i))}>\u2212</button>`;
  const inner = { ...field, array: null };
  const row = (/** @type {any} */ item, /** @type {number} */ i) => {
    const at = { ...shared, path: `${path}[${i}]` };
    const name = `${field.name} ${i + 1}`;
    const after = isFixed ? null : remove(i);
    if (field.kind === "message")
      return html`<${Group} key=${i} field=${inner} name=${name} state=${item} after=${after} ...${at} />`;
    const problem = problemOf(problems, at.path);
    const putItem = (/** @type {string} */ text) => put(value.map((old, n) => (n === i ? text : old)));
    return html`<div class=${`field row-field ${problem ? "bad" : ""}`} key=${i}>
      <${Input} field=${inner} value=${item} bad=${Boolean(problem)} label=${name} put=${putItem} ...${at} />${after}
      <${Problem} path=${at.path} text=${problem} /></div>`;
  };
  return html`<fieldset class="group-field rows-field">
    <legend>${field.name} <${Type} field=${field} /></legend>
    ${field.comment && html`<small class="comment">${field.comment}</small>`}
    <${Problem} path=${path} text=${problemOf(problems, path)} />
    ${value.map(row)}
    ${
      !isFixed &&
      html`<button type="button" class="small" disabled=${disabled || value.length >= MOST_ROWS} onClick=${add}>
        + ${field.name}</button>`
    }
  </fieldset>`;
}
