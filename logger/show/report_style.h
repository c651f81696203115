#pragma once
// Style sheet of the comparison page.

namespace morphbus::logger {

/// The text of the page's <style> element. Colors are variables, given once for light and once for
/// dark systems; nothing below names a color but through them (printing excepted).
///
/// `.A` and `.B`, `line-a` and `line-b` mark the two runs: blue and orange, which also people who
/// do not tell red from green can tell apart; B's lines are dashed besides, for print in black and
/// white. `.equivalent` and `.different` are the verdicts' words (VerdictName) as classes of the
/// banner; a verdict of neither class is unusable and has the color of a warning. `.over` marks a
/// value beyond its tolerance.
///
/// The classes `grid`, `frame`, `tick`, `label`, `title`, `legend`, `mark` and `mark-text` are
/// those that PlotSvg() (svg_plot.h) writes, and `line-d` is a line of differences.
///
/// Widths are such that two plots stand side by side on a screen, and below each other on a
/// telephone.
inline constexpr const char* kReportStyle = R"css(
:root{color-scheme:light dark;--bg:#f6f7f9;--card:#fff;--text:#1b1f26;--dim:#667085;--line:#dfe3ea;
--grid:#eceff4;--a:#1f6feb;--b:#bc4c00;--d:#8250df;--good:#1a7f37;--bad:#cf222e;--warn:#9a6700}
@media (prefers-color-scheme:dark){:root{--bg:#0f1319;--card:#171c24;--text:#e6e9ef;--dim:#98a2b3;
--line:#2b323d;--grid:#222935;--a:#6cb0ff;--b:#ffa657;--d:#d2a8ff;--good:#3fb950;--bad:#ff7b72;
--warn:#d9a520}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--text);
font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"DejaVu Sans",sans-serif}
main{max-width:1180px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:22px;font-weight:650;margin:0 0 16px}
h2{font-size:16px;font-weight:650;margin:0 0 10px}
section{margin-top:28px}
.banner{display:flex;gap:22px;align-items:center;background:var(--card);border:1px solid var(--line);
border-left:6px solid var(--warn);border-radius:8px;padding:16px 20px}
.banner.equivalent{border-left-color:var(--good)}.banner.different{border-left-color:var(--bad)}
.verdict{font-size:24px;font-weight:700;color:var(--warn)}
.equivalent .verdict{color:var(--good)}.different .verdict{color:var(--bad)}
.banner p{margin:2px 0}.reason{font-size:16px}.figures,.dim{color:var(--dim)}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(380px,1fr));gap:16px;margin-top:16px}
.card{background:var(--card);border:1px solid var(--line);border-radius:8px;padding:14px 18px;margin:0}
.card h2{overflow-wrap:anywhere}
.chip{display:inline-block;width:24px;text-align:center;border-radius:5px;color:var(--card);
font-weight:700}
.chip.A{background:var(--a)}.chip.B{background:var(--b)}
dl{display:grid;grid-template-columns:86px 1fr;gap:2px 12px;margin:0}
dt{color:var(--dim)}dd{margin:0;overflow-wrap:anywhere}
.notes{background:var(--card);border:1px solid var(--line);border-left:6px solid var(--warn);
border-radius:8px;padding:12px 18px}
.notes ul{margin:0;padding-left:20px;overflow-wrap:anywhere}
.scroll{overflow-x:auto;background:var(--card);border:1px solid var(--line);border-radius:8px}
table{border-collapse:collapse;width:100%;font-size:13px}
th,td{padding:5px 10px;text-align:left;border-bottom:1px solid var(--line);white-space:nowrap;
vertical-align:top}
.wide{font-size:12px}.wide th,.wide td{white-space:normal;padding:5px 5px}
th{color:var(--dim);font-weight:600}tbody tr:last-child td{border-bottom:0}
.n{text-align:right;font-variant-numeric:tabular-nums}.m{color:var(--dim);white-space:normal}
td.over,tr.over td.n{color:var(--bad);font-weight:650}
details{margin-top:14px}summary{cursor:pointer;color:var(--dim);margin-bottom:8px}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(480px,1fr));gap:14px}
figure{margin:0;background:var(--card);border:1px solid var(--line);border-radius:8px;padding:6px}
svg{display:block;width:100%;height:auto;font-family:inherit}
path{fill:none}.grid{stroke:var(--grid)}.frame{fill:none;stroke:var(--line)}
.tick,.label{font-size:11px;fill:var(--dim)}.title{font-size:13px;font-weight:600;fill:var(--text)}
.legend{font-size:12px;fill:var(--text)}
.line-a{stroke:var(--a);stroke-width:1.8}
.line-b{stroke:var(--b);stroke-width:1.6;stroke-dasharray:5 4}
.line-d{stroke:var(--d);stroke-width:1.4}
.mark{stroke:var(--bad);stroke-dasharray:2 3}.mark-text{font-size:10.5px;fill:var(--bad)}
.bar-text{font-size:10.5px}.fault{fill:var(--bad);stroke:var(--card)}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(300px,1fr));gap:14px}
img{display:block;width:100%;height:auto;border-radius:4px}
figcaption{padding:6px 6px 2px;color:var(--dim);font-size:13px}
.keys{display:flex;flex-wrap:wrap;gap:4px 18px;font-size:13px}.keys span{white-space:nowrap}
.keys i{display:inline-block;width:12px;height:12px;border-radius:3px;margin-right:6px;
vertical-align:-1px}
section>figure{margin-top:14px;max-width:860px}
@media (max-width:560px){main{padding:18px 12px 40px}.banner{display:block}
.cards,.plots{grid-template-columns:minmax(0,1fr)}.pictures{grid-template-columns:minmax(0,1fr)}
h1{font-size:18px;overflow-wrap:anywhere}}
@media print{body{background:#fff}figure,section{break-inside:avoid}}
)css";

}  // namespace morphbus::logger
