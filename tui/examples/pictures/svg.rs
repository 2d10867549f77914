//! A terminal's screen as an SVG picture. Lines, blocks and Braille dots are drawn as shapes, so that the picture looks
//! the same whatever fonts the reader has; letters are set in a monospaced font, each run held to its own columns.

use std::fmt::Write as _;

use vt100::{Cell, Color, Screen};

/// Size of a character cell, in units of the picture.
const CELL: (f64, f64) = (8.4, 17.0);
/// Air around the screen.
const MARGIN: f64 = 10.0;
/// Where the base line of text is in its cell, from the top.
const BASE_LINE: f64 = 13.0;
/// Colours of a dark terminal: background, text, then the sixteen.
const BACKGROUND: &str = "#16181d";
const TEXT: &str = "#d5d9e0";
const SIXTEEN: [&str; 16] = [
    "#16181d", "#b8324a", "#86c06c", "#e3b95f", "#6ea8ec", "#c792ea", "#4fc1d0", "#f2f4f8", "#7d8492",
    "#ff6b81", "#a5dd8b", "#ffd479", "#8fc1ff", "#dbb0f5", "#78dbe8", "#ffffff",
];

/// Draws `screen`.
pub(crate) fn picture(screen: &Screen) -> String {
    let (rows, columns) = (u16::from(screen.size().0), u16::from(screen.size().1));
    let width = f64::from(columns) * CELL.0 + 2.0 * MARGIN;
    let height = f64::from(rows) * CELL.1 + 2.0 * MARGIN;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" font-family=\"'DejaVu Sans Mono', Menlo, Consolas, 'Liberation Mono', monospace\" \
         font-size=\"14\">\n<rect width=\"100%\" height=\"100%\" rx=\"7\" fill=\"{BACKGROUND}\"/>\n"
    );
    for row in 0..rows {
        draw_row(&mut svg, screen, row, columns);
    }
    svg.push_str("</svg>\n");
    svg
}

/// The colours of a cell as seen: reversal and boldness done.
#[derive(Clone, Copy, PartialEq)]
struct Look {
    ink: &'static str,
    paper: &'static str,
    bold: bool,
    dim: bool,
}

impl Look {
    fn of(cell: &Cell) -> Self {
        let (ink, paper) = (colour(cell.fgcolor(), TEXT), colour(cell.bgcolor(), BACKGROUND));
        let (ink, paper) = if cell.inverse() { (paper, ink) } else { (ink, paper) };
        Self { ink, paper, bold: cell.bold(), dim: cell.dim() }
    }
}

/// A colour of the terminal's sixteen; others are not used by the screens.
fn colour(colour: Color, default: &'static str) -> &'static str {
    match colour {
        Color::Idx(index) => SIXTEEN.get(usize::from(index)).copied().unwrap_or(default),
        Color::Default | Color::Rgb(..) => default,
    }
}

fn draw_row(svg: &mut String, screen: &Screen, row: u16, columns: u16) {
    let cells: Vec<(char, Look)> = (0..columns)
        .filter_map(|column| screen.cell(row, column))
        .map(|cell| (cell.contents().chars().next().unwrap_or(' '), Look::of(cell)))
        .collect();
    let top = MARGIN + f64::from(row) * CELL.1;
    for run in cells.chunk_by(|left, right| left.1.paper == right.1.paper).scan(0, placed) {
        let (start, cells) = run;
        if let Some((_, look)) = cells.first().filter(|(_, look)| look.paper != BACKGROUND) {
            let (x, width) = (left(start), cells.len() as f64 * CELL.0);
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
                CELL.1, look.paper
            );
        }
    }
    for (start, cells) in
        cells.chunk_by(|left, right| left.1 == right.1 && kind(left.0) == kind(right.0)).scan(0, placed)
    {
        let Some((first, look)) = cells.first() else { continue };
        match kind(*first) {
            Kind::Blank => {}
            Kind::Shape => shapes(svg, cells, start, top, look.ink),
            Kind::Letter => letters(svg, cells, start, top, *look),
            Kind::Sign => {
                for (index, (sign, _)) in cells.iter().enumerate() {
                    let x = left(start + index) + CELL.0 / 2.0;
                    let y = top + BASE_LINE;
                    let _ = writeln!(
                        svg,
                        "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{}\" text-anchor=\"middle\">{}</text>",
                        look.ink,
                        escaped(&sign.to_string())
                    );
                }
            }
        }
    }
}

/// Keeps count of where a run of cells begins.
#[expect(clippy::unnecessary_wraps, reason = "the form that scan asks for")]
fn placed<'a>(next: &mut usize, cells: &'a [(char, Look)]) -> Option<(usize, &'a [(char, Look)])> {
    let start = *next;
    *next += cells.len();
    Some((start, cells))
}

fn left(column: usize) -> f64 {
    MARGIN + column as f64 * CELL.0
}

/// How a character is drawn.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Blank,
    /// Lines, blocks and Braille.
    Shape,
    /// What every monospaced font has.
    Letter,
    /// What may come from another font, and so is placed one by one.
    Sign,
}

fn kind(character: char) -> Kind {
    match character {
        ' ' => Kind::Blank,
        // Straight lines and corners; other lines are left to the font.
        '\u{2500}'..='\u{2503}' | '\u{250f}' | '\u{2513}' | '\u{2517}' | '\u{251b}' => Kind::Shape,
        '\u{256d}'..='\u{2570}' | '\u{2580}'..='\u{259f}' | '\u{2800}'..='\u{28ff}' => Kind::Shape,
        '!'..='~' | '\u{a1}'..='\u{ff}' => Kind::Letter,
        _ => Kind::Sign,
    }
}

fn letters(svg: &mut String, cells: &[(char, Look)], start: usize, top: f64, look: Look) {
    let text: String = cells.iter().map(|(character, _)| *character).collect();
    let (x, y, width) = (left(start), top + BASE_LINE, cells.len() as f64 * CELL.0);
    let weight = if look.bold { " font-weight=\"bold\"" } else { "" };
    let faint = if look.dim { " opacity=\"0.6\"" } else { "" };
    let _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" textLength=\"{width:.1}\" lengthAdjust=\"spacingAndGlyphs\" fill=\"{}\"{weight}{faint}>{}</text>",
        look.ink,
        escaped(&text)
    );
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// What shapes are made of: filled areas, strokes by width, dots.
#[derive(Default)]
struct Shapes {
    areas: String,
    shaded: String,
    thin: String,
    thick: String,
    dots: String,
}

fn shapes(svg: &mut String, cells: &[(char, Look)], start: usize, top: f64, ink: &str) {
    let mut shapes = Shapes::default();
    for (index, (character, _)) in cells.iter().enumerate() {
        shapes.add(*character, left(start + index), top);
    }
    let Shapes { areas, shaded, thin, thick, dots } = shapes;
    for (path, style) in [
        (areas, format!("fill=\"{ink}\"")),
        (shaded, format!("fill=\"{ink}\" opacity=\"0.35\"")),
        (thin, format!("fill=\"none\" stroke=\"{ink}\" stroke-width=\"1\"")),
        (thick, format!("fill=\"none\" stroke=\"{ink}\" stroke-width=\"2\"")),
        (dots, format!("fill=\"none\" stroke=\"{ink}\" stroke-width=\"2.3\" stroke-linecap=\"round\"")),
    ] {
        if !path.is_empty() {
            let _ = writeln!(svg, "<path d=\"{path}\" {style}/>");
        }
    }
}

impl Shapes {
    fn add(&mut self, character: char, x: f64, y: f64) {
        match character {
            '\u{2800}'..='\u{28ff}' => self.braille(u32::from(character) - 0x2800, x, y),
            '\u{2580}'..='\u{259f}' => self.block(character, x, y),
            _ => self.line(character, x, y),
        }
    }

    fn braille(&mut self, bits: u32, x: f64, y: f64) {
        // Bit of each dot, from the top, left column then right (Unicode, Braille Patterns).
        const BITS: [[u32; 2]; 4] = [[0, 3], [1, 4], [2, 5], [6, 7]];
        for (row, pair) in BITS.iter().enumerate() {
            for (column, bit) in pair.iter().enumerate() {
                if bits >> bit & 1 == 1 {
                    let (x, y) =
                        (x + CELL.0 * (0.25 + 0.5 * column as f64), y + CELL.1 * (0.125 + 0.25 * row as f64));
                    let _ = write!(self.dots, "M{x:.1} {y:.1}h0");
                }
            }
        }
    }

    fn block(&mut self, character: char, x: f64, y: f64) {
        let eighths = |count: u32| f64::from(count) / 8.0;
        let code = u32::from(character);
        match character {
            '\u{2580}' => self.area(x, y, 1.0, 0.5),
            '\u{2581}'..='\u{2588}' => {
                let high = eighths(code - 0x2580);
                self.area(x, y + CELL.1 * (1.0 - high), 1.0, high);
            }
            '\u{2589}'..='\u{258f}' => self.area(x, y, eighths(0x2590 - code), 1.0),
            '\u{2590}' => self.area(x + CELL.0 / 2.0, y, 0.5, 1.0),
            '\u{2591}'..='\u{2593}' => {
                let _ = write!(self.shaded, "M{x:.1} {y:.1}h{:.1}v{:.1}h-{:.1}z", CELL.0, CELL.1, CELL.0);
            }
            _ => {
                for (quarter, filled) in quarters(character).into_iter().enumerate() {
                    if filled {
                        let (right, down) = ((quarter % 2) as f64, (quarter / 2) as f64);
                        self.area(x + right * CELL.0 / 2.0, y + down * CELL.1 / 2.0, 0.5, 0.5);
                    }
                }
            }
        }
    }

    fn area(&mut self, x: f64, y: f64, wide: f64, high: f64) {
        let (width, height) = (wide * CELL.0, high * CELL.1);
        let _ = write!(self.areas, "M{x:.1} {y:.1}h{width:.2}v{height:.2}h-{width:.2}z");
    }

    fn line(&mut self, character: char, x: f64, y: f64) {
        let (right, bottom) = (x + CELL.0, y + CELL.1);
        let (middle, centre) = (x + CELL.0 / 2.0, y + CELL.1 / 2.0);
        let mut draw = |thick: bool, path: String| {
            if thick { self.thick.push_str(&path) } else { self.thin.push_str(&path) }
        };
        match character {
            '\u{2500}' | '\u{2501}' => {
                draw(character == '\u{2501}', format!("M{x:.1} {centre:.1}H{right:.1}"))
            }
            '\u{2502}' | '\u{2503}' => {
                draw(character == '\u{2503}', format!("M{middle:.1} {y:.1}V{bottom:.1}"))
            }
            '\u{256d}' => draw(false, format!("M{middle:.1} {bottom:.1}V{centre:.1}H{right:.1}")),
            '\u{256e}' => draw(false, format!("M{x:.1} {centre:.1}H{middle:.1}V{bottom:.1}")),
            '\u{2570}' => draw(false, format!("M{middle:.1} {y:.1}V{centre:.1}H{right:.1}")),
            '\u{256f}' => draw(false, format!("M{x:.1} {centre:.1}H{middle:.1}V{y:.1}")),
            '\u{250f}' => draw(true, format!("M{middle:.1} {bottom:.1}V{centre:.1}H{right:.1}")),
            '\u{2513}' => draw(true, format!("M{x:.1} {centre:.1}H{middle:.1}V{bottom:.1}")),
            '\u{2517}' => draw(true, format!("M{middle:.1} {y:.1}V{centre:.1}H{right:.1}")),
            '\u{251b}' => draw(true, format!("M{x:.1} {centre:.1}H{middle:.1}V{y:.1}")),
            _ => {}
        }
    }
}

/// Which quarters a quadrant character fills: upper left, upper right, lower left, lower right.
fn quarters(character: char) -> [bool; 4] {
    let bits = match character {
        '\u{2596}' => 0b0010,
        '\u{2597}' => 0b0001,
        '\u{2598}' => 0b1000,
        '\u{2599}' => 0b1011,
        '\u{259a}' => 0b1001,
        '\u{259b}' => 0b1110,
        '\u{259c}' => 0b1101,
        '\u{259d}' => 0b0100,
        '\u{259e}' => 0b0110,
        '\u{259f}' => 0b0111,
        _ => 0,
    };
    [3, 2, 1, 0].map(|bit| bits >> bit & 1 == 1)
}
