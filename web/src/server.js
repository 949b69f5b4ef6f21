// What the page asks the server that it came from: contact regions for any foot, plans. Pages in files ask nobody.
import { planFrom } from './data.js';

export const hasServer = () => document.querySelector('meta[name="octosurf-server"]') !== null;

/** The run whose map the page follows; null: the map is finished. */
export const runToFollow = () => document.querySelector('meta[name="octosurf-run"]')?.content ?? null;

/** @param {object} parameters @returns {Promise<object>} the answer; throws what the server says against the question */
async function ask(path, parameters) {
  const reply = await fetch(`${path}?${new URLSearchParams(parameters)}`);  // a list with commas
  const answer = await reply.json();
  if (!reply.ok) throw new Error(`${answer.where}: ${answer.error}; ${answer.hint}`);
  return answer;
}

const byId = (id) => document.getElementById(id);

export class Asking {
  /** @param {object} page see main.js */
  constructor(page) {
    this.page = page;
    byId('asking').hidden = false;
    byId('foot-form').addEventListener('submit', (event) => {
      event.preventDefault();
      this.askRegions();
    });
    byId('plan-button').addEventListener('click', () => this.pickEnds(byId('plan-button').ariaPressed !== 'true'));
  }

  answer(text) {
    byId('asking-answer').textContent = text;
  }

  /** What the form says, as /api/regions/all takes it; a field left empty is left out. */
  parameters() {
    return Object.fromEntries([...new FormData(byId('foot-form'))].filter(([, text]) => text.trim() !== ''));
  }

  async askRegions() {
    const parameters = this.parameters(), { page } = this;
    const { foot, ...limits } = parameters;
    const asked = [`${foot ?? 'usual foot'} m`, ...Object.entries(limits).map(([key, value]) =>
      `${key.replace(/_(m|deg)$/, '').replaceAll('_', ' ')} ${value} ${key.endsWith('_deg') ? '°' : 'm'}`)];
    this.answer('asked …');
    try {
      const answer = await ask('/api/regions/all', parameters);
      page.takeFoot({ name: `asked at revision ${answer.revision}: ${asked.join(', ')}`, regions: answer.regions });
      this.answer('');
    } catch (error) {
      this.answer(error.message);
    }
  }

  /** The next two places that are clicked are the ends of a plan. */
  pickEnds(on) {
    this.ends = on ? [] : null;
    byId('plan-button').ariaPressed = String(on);
    this.page.view.canvas.classList.toggle('measuring', on);
    this.answer(on ? 'Click where it starts, then where it ends.' : '');
  }

  /** @param {number[]} place root coordinates @returns {boolean} whether the click was for this */
  click(place) {
    if (!this.ends) return false;
    this.ends.push(place);
    this.page.highlight.measured(this.ends);
    if (this.ends.length === 2) {
      const ends = this.ends;
      this.pickEnds(false);
      this.askPlan(ends);
    }
    return true;
  }

  async askPlan(ends) {
    const { page } = this, robot = byId('plan-robot').value;
    const yaw = page.yawDeg(...ends), [from, to] = ends.map((end) => [...page.map.toMap(end), yaw]);
    this.answer('asked …');
    try {
      const plan = await ask('/api/plan', { from, to, robot });
      page.takePlan(planFrom(page.map, { ...plan, name: `asked (${robot})` }));
      this.answer(plan.found ? `${plan.steps.length} steps` : plan.refusal.sentence);
    } catch (error) {
      this.answer(error.message);
    }
    page.highlight.measured([]);
  }
}
