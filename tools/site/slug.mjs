/** The name that GitHub gives to a heading, by which the documents link to it. */
export function slug(heading) {
  return heading.toLowerCase().replace(/[^\p{L}\p{N}_\- ]/gu, '').replaceAll(' ', '-');
}
