// What the page asks the server that it came from: contact regions for any foot. Pages in files ask nobody.
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
}
