// What the page asks the server that it came from: contact regions for any foot. Pages in files ask nobody.
export const hasServer = () => document.querySelector('meta[name="octosurf-server"]') !== null;

/** The run whose map the page follows; null: the map is finished. */
export const runToFollow = () => document.querySelector('meta[name="octosurf-run"]')?.content ?? null;

/** Has the panel's form ask for contact regions. @param {object} page see main.js */
export function bindForm(page) {
  const form = document.getElementById('foot-form'), say = (text) => { document.getElementById('asking-answer').textContent = text; };
  document.getElementById('asking').hidden = false;
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    const parameters = [...new FormData(form)].filter(([, text]) => text.trim() !== '');
    say('asked …');
    try {
      const reply = await fetch(`api/regions/all?${new URLSearchParams(parameters)}`), answer = await reply.json();
      if (!reply.ok) throw new Error(`${answer.where}: ${answer.error}; ${answer.hint}`);
      const limits = parameters.map(([name, value]) => `${name} ${value}`).join(', ');
      page.takeFoot({ name: `asked at revision ${answer.revision}: ${limits}`, regions: answer.regions });
      say('');
    } catch (error) {
      say(error.message);
    }
  });
}
