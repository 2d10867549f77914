//! A picture in memory: discs, lines and letters on paper, smoothed by drawing everything twice as large.

use font8x8::UnicodeFonts;

/// A colour: red, green, blue.
pub(super) type Ink = [u8; 3];

/// How much larger everything is drawn before it is smoothed.
const FINE: usize = 2;

/// A picture that is being drawn. Positions are pixels of the finished picture, from its upper left corner.
pub(super) struct Raster {
    width: usize,
    height: usize,
    /// `FINE` times as wide and high.
    pixels: Vec<Ink>,
}

impl Raster {
    /// Paper.
    pub(super) fn new(width: usize, height: usize, paper: Ink) -> Self {
        Self { width, height, pixels: vec![paper; width * FINE * height * FINE] }
    }

    fn dot(&mut self, x: i64, y: i64, ink: Ink) {
        let (wide, high) = ((self.width * FINE) as i64, (self.height * FINE) as i64);
        if (0..wide).contains(&x)
            && (0..high).contains(&y)
            && let Some(pixel) = self.pixels.get_mut((y * wide + x) as usize)
        {
            *pixel = ink;
        }
    }

    /// A disc.
    pub(super) fn disc(&mut self, x: f64, y: f64, radius: f64, ink: Ink) {
        let fine = FINE as f64;
        let (x, y, radius) = (x * fine, y * fine, radius * fine);
        let reach = radius.ceil() as i64;
        let (middle_x, middle_y) = (x.floor() as i64, y.floor() as i64);
        for down in -reach..=reach {
            for across in -reach..=reach {
                let (at_x, at_y) = (middle_x + across, middle_y + down);
                if (at_x as f64 + 0.5 - x).hypot(at_y as f64 + 0.5 - y) <= radius.max(0.71) {
                    self.dot(at_x, at_y, ink);
                }
            }
        }
    }

    /// A straight line; what lies far outside is left out.
    pub(super) fn line(&mut self, from: (f64, f64), to: (f64, f64), width: f64, ink: Ink) {
        let reach = (self.width + self.height) as f64;
        if [from.0, from.1, to.0, to.1].iter().any(|axis| axis.abs() > 4.0 * reach) {
            return;
        }
        let steps = ((to.0 - from.0).hypot(to.1 - from.1) * FINE as f64).ceil().max(1.0);
        for step in 0..=steps as u32 {
            let fraction = f64::from(step) / steps;
            self.disc(
                from.0 + fraction * (to.0 - from.0),
                from.1 + fraction * (to.1 - from.1),
                width / 2.0,
                ink,
            );
        }
    }

    /// Width and height of a letter, pixels.
    pub(super) const LETTER: usize = 16;

    /// Letters from their upper left corner.
    pub(super) fn text(&mut self, x: usize, y: usize, text: &str, ink: Ink) {
        // Eight pixels are drawn four times as large, and everything is smoothed by half after that.
        const SIDE: usize = Raster::LETTER * FINE;
        for (index, letter) in text.chars().enumerate() {
            let glyph = font8x8::BASIC_FONTS
                .get(letter)
                .or_else(|| font8x8::BASIC_FONTS.get('?'))
                .unwrap_or_default();
            let pixels: Vec<bool> =
                glyph.iter().flat_map(|bits| (0..8).map(move |column| bits >> column & 1 == 1)).collect();
            let smooth = doubled(&doubled(&pixels, 8), 16);
            for (at, _) in smooth.iter().enumerate().filter(|(_, is_inked)| **is_inked) {
                let (left, top) = ((x + index * Self::LETTER) * FINE, y * FINE);
                self.dot((left + at % SIDE) as i64, (top + at / SIDE) as i64, ink);
            }
        }
    }

    /// The finished picture as PNG.
    pub(super) fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut smooth = Vec::with_capacity(self.width * self.height * 3);
        let wide = self.width * FINE;
        for y in 0..self.height {
            for x in 0..self.width {
                for channel in 0..3 {
                    let mut sum = 0_usize;
                    for down in 0..FINE {
                        for across in 0..FINE {
                            let pixel = self.pixels.get((y * FINE + down) * wide + x * FINE + across);
                            sum += usize::from(pixel.map_or(0, |pixel| pixel[channel]));
                        }
                    }
                    smooth.push((sum / (FINE * FINE)) as u8);
                }
            }
        }
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&smooth)?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// A square of pixels drawn twice as large with its stairs smoothed: Scale2x (Mazzoleni 2001), where a corner takes the colour of the two sides
/// that meet in it if these are alike and the sides across are not.
fn doubled(pixels: &[bool], side: usize) -> Vec<bool> {
    let at = |row: usize, column: usize| pixels.get(row * side + column).copied().unwrap_or_default();
    let mut large = vec![false; 4 * pixels.len()];
    for row in 0..side {
        for column in 0..side {
            let middle = at(row, column);
            // Around a letter there is paper.
            let inside = |is_inside: bool, pixel: bool| is_inside && pixel;
            let above = inside(row > 0, at(row.saturating_sub(1), column));
            let below = inside(row + 1 < side, at(row + 1, column));
            let before = inside(column > 0, at(row, column.saturating_sub(1)));
            let after = inside(column + 1 < side, at(row, column + 1));
            let is_smoothed = above != below && before != after;
            let corner = |one: bool, other: bool| if is_smoothed && one == other { one } else { middle };
            let corners =
                [corner(above, before), corner(above, after), corner(below, before), corner(below, after)];
            for (quadrant, corner) in corners.into_iter().enumerate() {
                let index = (2 * row + quadrant / 2) * 2 * side + 2 * column + quadrant % 2;
                if let Some(pixel) = large.get_mut(index) {
                    *pixel = corner;
                }
            }
        }
    }
    large
}

#[cfg(test)]
mod tests {
    use super::doubled;

    #[test]
    fn a_slanting_line_loses_its_stairs_and_a_straight_one_stays() {
        let shown = |pixels: &[bool], side: usize| -> Vec<String> {
            let row = |row: &[bool]| row.iter().map(|pixel| if *pixel { '#' } else { '.' }).collect();
            doubled(pixels, side).chunks(2 * side).map(row).collect()
        };
        assert_eq!(shown(&[true, false, false, true], 2), ["##..", "###.", ".###", "..##"]);
        assert_eq!(shown(&[true, false, true, false], 2), ["##..", "##..", "##..", "##.."]);
    }
}
