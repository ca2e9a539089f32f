// The form of the object's panel by which a person corrects the map, and the corrections that stand.
import { escaped } from './words.js';

const KINDS = { not_there: 'It is not there', class: 'Its class is', same: 'It is the same as', different: 'It is different from' };

export class Corrections {
  constructor(connection) {
    this.connection = connection;
    this.id = 0;
    this.element = document.createElement('form');
    this.element.className = 'corrections';
    const options = Object.entries(KINDS).map(([kind, words]) => `<option value="${kind}">${words}</option>`);
    this.element.innerHTML = `<h3>Correct the map</h3><ul></ul><select name="kind" aria-label="What is wrong">${options.join('')}</select>
      <input name="value" aria-label="Class, or id of the other object" hidden><button>Correct</button><p class="dim" role="status"></p>`;
    this.element.addEventListener('change', () => this.showInput());
    this.element.addEventListener('submit', (e) => { e.preventDefault(); this.send(this.request()); });
    this.element.addEventListener('click', (e) => {
      const button = e.target.closest('[data-withdraw]');
      if (button) this.send({ withdraw: Number(button.dataset.withdraw) });
    });
  }

  get fields() { return this.element.elements; }

  showInput() {
    const kind = this.fields.kind.value;
    this.fields.value.hidden = kind === 'not_there';
    this.fields.value.placeholder = kind === 'class' ? 'class' : 'id';
  }

  request() {
    const kind = this.fields.kind.value, value = this.fields.value.value.trim();
    const more = kind === 'class' ? { class: value } : kind === 'not_there' ? {} : { other: Number(value) };
    return { object: this.id, kind, author: 'page', ...more };
  }

  show(id) {
    this.id = id;
    this.render([]);
    this.say('');
    this.ask();
  }

  say(words) { this.element.querySelector('[role=status]').textContent = words; }

  async ask() {
    const id = this.id;
    const reply = await this.connection.call('/map/query', { id }).catch(() => ({}));
    if (id === this.id) this.render(reply.corrections ?? []);
  }

  async send(request) {
    try {
      await this.connection.call('/map/correct', request);
      this.say(request.withdraw ? 'It is taken back.' : 'The map has the correction.');
      await this.ask();
    } catch (error) {
      this.say(error.message);
    }
  }

  render(corrections) {
    const words = (c) => `${KINDS[c.kind]} ${c.kind === 'class' ? c.class : c.kind === 'not_there' ? '' : c.object === this.id ? c.other : c.object}`;
    this.element.querySelector('ul').innerHTML = corrections.map((c) => `<li>${escaped(words(c))} <span class="dim">${c.nats.toFixed(1)} nats, ${escaped(c.author)}</span>
      <button type="button" data-withdraw="${c.id}">Take back</button></li>`).join('');
  }
}
