//! A picture in memory: discs, lines and letters on paper, smoothed by drawing everything twice as large.

use font8x8::UnicodeFonts;

/// A colour: red, green, blue.
pub(super) type Ink = [u8; 3];

/// How much larger everything is drawn before it is smoothed.
const FINE: usize = 2;

/// A picture that is being drawn. Places are pixels of the finished picture, from its upper left corner.
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
            let share = f64::from(step) / steps;
            self.disc(from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1), width / 2.0, ink);
        }
    }

    /// Letters, 16 pixels high, from their upper left corner.
    pub(super) fn text(&mut self, x: usize, y: usize, text: &str, ink: Ink) {
        const SIZE: usize = 2 * FINE;
        for (place, letter) in text.chars().enumerate() {
            let glyph = font8x8::BASIC_FONTS
                .get(letter)
                .or_else(|| font8x8::BASIC_FONTS.get('?'))
                .unwrap_or_default();
            for (row, bits) in glyph.iter().enumerate() {
                for column in (0..8).filter(|column| bits >> column & 1 == 1) {
                    let (left, top) = (x * FINE + (place * 8 + column) * SIZE, y * FINE + row * SIZE);
                    for down in 0..SIZE {
                        for across in 0..SIZE {
                            self.dot((left + across) as i64, (top + down) as i64, ink);
                        }
                    }
                }
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
