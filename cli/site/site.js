// Search on the index, and the looping face on an entry's page. A classic script: these load from file:// too.
(function () {
  'use strict';

  // ---- The index: an entry is shown if it holds every word that is looked for, and if language and function fit.
  var search = document.getElementById('search');
  if (search) {
    var language = document.getElementById('language');
    var role = document.getElementById('function');
    var count = document.getElementById('count');
    var items = Array.prototype.slice.call(document.querySelectorAll('li[data-search]'));
    var groups = Array.prototype.slice.call(document.querySelectorAll('[data-group]')).reverse();

    var filter = function () {
      var words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
      var shown = 0;
      items.forEach(function (item) {
        var fits = (!language || !language.value || item.dataset.lexicon === language.value) &&
          (!role.value || item.dataset.function === role.value) &&
          words.every(function (word) { return item.dataset.search.indexOf(word) >= 0; });
        item.hidden = !fits;
        if (fits) shown += 1;
      });
      groups.forEach(function (group) { group.hidden = !group.querySelector('li[data-search]:not([hidden])'); });
      count.textContent = shown === 1 ? '1 entry' : shown + ' entries';
    };
    var links = function () {
      return items.filter(function (item) { return !item.hidden; }).map(function (item) { return item.querySelector('a'); });
    };
    search.addEventListener('input', filter);
    if (language) language.addEventListener('change', filter);
    role.addEventListener('change', filter);
    document.getElementById('search-form').addEventListener('submit', function (event) {
      event.preventDefault();
      var first = links()[0];
      if (first && search.value) first.click();
    });
    document.addEventListener('keydown', function (event) {
      if (event.altKey || event.ctrlKey || event.metaKey) return;
      var all = links();
      var at = all.indexOf(document.activeElement);
      if (event.key === 'ArrowDown' && (at >= 0 || document.activeElement === search)) {
        if (at + 1 < all.length) all[at + 1].focus();
        event.preventDefault();
      } else if (event.key === 'ArrowUp' && at >= 0) {
        (at === 0 ? search : all[at - 1]).focus();
        event.preventDefault();
      } else if (event.key === 'Escape' && at >= 0) {
        search.focus();
      }
    });
    filter(); // what was typed before a page was left and come back to
    return;
  }

  // ---- An entry's page
  var canvas = document.getElementById('face');
  if (!canvas) return;
  var controls = document.getElementById('controls');
  var problem = document.getElementById('problem');
  var play = document.getElementById('play');
  var time = document.getElementById('time');
  var clock = document.getElementById('clock');
  var start = Number(canvas.dataset.start);
  var dark = matchMedia('(prefers-color-scheme: dark)');
  var still = matchMedia('(prefers-reduced-motion: reduce)');

  var bytes = function () {
    var text = atob(window.nmsFace);
    var out = new Uint8Array(text.length);
    for (var i = 0; i < text.length; i += 1) out[i] = text.charCodeAt(i);
    return out.buffer;
  };
  var fail = function (error) {
    canvas.hidden = true;
    document.getElementById('still').hidden = false;
    problem.textContent = 'The face cannot be shown here: ' + (error && error.message ? error.message : error);
    problem.hidden = false;
    window.nmsFailed = problem.textContent;
  };

  if (!window.nmsViewer || !window.nmsFace) {
    fail('its scripts are missing');
    return;
  }
  window.nmsViewer.show(canvas, bytes(), canvas.dataset.clip).then(function (player) {
    time.max = String(Math.round(player.duration * 1000));
    player.ontime = function () {
      time.value = String(Math.round(player.time * 1000));
      var text = (start + player.time).toFixed(2) + ' s';
      if (clock.textContent !== text) clock.textContent = text;
      time.setAttribute('aria-valuetext', text);
    };
    var label = function () { play.textContent = player.playing ? 'Pause' : 'Play'; };
    var background = function () { player.background(dark.matches ? '#23262b' : '#e3e6ea'); };
    play.addEventListener('click', function () {
      if (player.playing) player.pause(); else player.play();
      label();
    });
    time.addEventListener('input', function () {
      player.pause();
      player.seek(Number(time.value) / 1000);
      label();
    });
    document.getElementById('speed').addEventListener('change', function (event) {
      player.speed = Number(event.target.value);
    });
    document.getElementById('view').addEventListener('change', function (event) { player.view(event.target.value); });
    dark.addEventListener('change', background);
    still.addEventListener('change', function () {
      if (still.matches) player.pause();
      label();
    });
    background();
    controls.hidden = false;
    // Who wants less motion gets the moment that shows most, and may press Play.
    if (still.matches) player.seek(Number(canvas.dataset.telling) - start); else player.play();
    label();
    window.nmsPlayer = player;
  }, fail);
}());
