//! Which of the pictures a camera sends are kept, and what is wrong with those that are not.

use std::collections::VecDeque;

use plumb_plugin::PluginError;

use crate::capture::{CaptureError, Shot, Stamp};
use crate::grey::Layout;

/// Pictures that nobody has fetched may take so many bytes.
const MOST_KEPT_BYTES: usize = 512 << 20;

/// So many damaged pictures in a row are a broken cable, not chance.
const MOST_DAMAGED: u32 = 10;

/// A picture that is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Picture {
    /// The middle of its exposure, ns of `CLOCK_MONOTONIC`.
    pub(crate) time_ns: u64,
    /// 8 bits of grey each, a row after the other.
    pub(crate) pixels: Vec<u8>,
}

/// When a picture is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Requested {
    Not,
    /// One whose shutter opened at this moment or later, ns.
    OpenedSince(u64),
    /// One each so many ns; the next is due then.
    Every {
        every_ns: u64,
        due_ns: Option<u64>,
    },
}

/// What a camera has taken and nobody has fetched.
#[derive(Debug)]
pub(crate) struct Film {
    layout: Layout,
    exposure_ns: Option<u64>,
    requested: Requested,
    kept: VecDeque<Picture>,
    /// Number and time of the last buffer.
    last: Option<(u32, u64)>,
    /// Time of the buffer before it.
    before_last_ns: u64,
    /// Damaged ones since the last that was whole.
    damaged: u32,
    /// What went wrong since it was asked last.
    trouble: Option<PluginError>,
    /// Why no more will come.
    ended: Option<String>,
}

impl Film {
    pub(crate) fn new(layout: Layout, exposure_ns: Option<u64>) -> Self {
        Self {
            layout,
            exposure_ns,
            requested: Requested::Not,
            kept: VecDeque::new(),
            last: None,
            before_last_ns: 0,
            damaged: 0,
            trouble: None,
            ended: None,
        }
    }

    /// Keeps one picture every so many ns from now on, or none before one is asked for. What was kept so far is forgotten.
    ///
    /// # Errors
    /// [`PluginError::Refused`] when the camera is not so fast.
    pub(crate) fn keep_every(&mut self, every_ns: Option<u64>) -> Result<(), PluginError> {
        if let (Some(every_ns), Some(interval_ns)) = (every_ns, self.layout.interval_ns)
            && every_ns < interval_ns / 10 * 9
        {
            return Err(PluginError::Refused(format!(
                "a picture every {:.1} ms is asked for, but the camera takes one every {:.1} ms: set `frames_per_second`, go slower, or with greater steps",
                every_ns as f64 / 1e6,
                interval_ns as f64 / 1e6
            )));
        }
        self.forget();
        self.requested =
            every_ns.map_or(Requested::Not, |every_ns| Requested::Every { every_ns, due_ns: None });
        Ok(())
    }

    /// Forgets what was kept and what went wrong.
    pub(crate) fn forget(&mut self) {
        self.kept.clear();
        self.trouble = None;
        self.damaged = 0;
    }

    /// From now on no picture is wanted; those that were kept stay.
    pub(crate) fn want_no_more(&mut self) {
        self.requested = Requested::Not;
    }

    /// From now on a picture is wanted whose shutter opened at this moment or later, ns.
    pub(crate) fn want_one_since(&mut self, moment_ns: u64) {
        self.requested = Requested::OpenedSince(moment_ns);
    }

    /// The oldest picture that was kept, and how many more there are.
    ///
    /// # Errors
    /// What went wrong since it was asked last; why no more will come, once all have been fetched.
    pub(crate) fn fetch(&mut self) -> Result<Option<(Picture, usize)>, PluginError> {
        if let Some(trouble) = self.trouble.take() {
            return Err(trouble);
        }
        match (self.kept.pop_front(), &self.ended) {
            (Some(picture), _) => Ok(Some((picture, self.kept.len()))),
            (None, Some(ended)) => Err(PluginError::Disconnected(ended.clone())),
            (None, None) => Ok(None),
        }
    }

    /// No more pictures come.
    pub(crate) fn end(&mut self, why: &CaptureError) {
        self.ended = Some(why.to_string());
    }

    pub(crate) fn layout(&self) -> Layout {
        self.layout
    }

    /// Whether any buffer has come so far.
    pub(crate) fn has_begun(&self) -> bool {
        self.last.is_some()
    }

    /// Takes a buffer that came in at `now_ns`.
    pub(crate) fn take(&mut self, shot: &Shot<'_>, now_ns: u64) {
        let (time_ns, opened_ns) = self.exposed(shot.stamp, now_ns);
        let before = self.last;
        if let Some((_, last_ns)) = before
            && time_ns < last_ns
        {
            let early_ms = (last_ns - time_ns) as f64 / 1e6;
            self.note(PluginError::InputLost(format!(
                "picture {} came out of order, {early_ms:.1} ms behind one that came before it; it is left out",
                shot.number
            )));
            return;
        }
        self.before_last_ns = before.map_or(0, |(_, last_ns)| last_ns);
        self.last = Some((shot.number, time_ns));
        let missing = before.map_or(0, |(number, _)| shot.number.wrapping_sub(number).saturating_sub(1));
        let requested = self.requested;
        match requested {
            Requested::OpenedSince(moment_ns) if opened_ns >= moment_ns && self.keep(shot, time_ns) => {
                self.requested = Requested::Not;
            }
            Requested::Every { every_ns, due_ns } if due_ns.is_none_or(|due_ns| time_ns >= due_ns) => {
                let due_ns = due_ns.unwrap_or(time_ns);
                let interval_ns =
                    before.map_or(0, |(_, last_ns)| time_ns - last_ns) / (u64::from(missing) + 1);
                if missing > 0 && time_ns - interval_ns >= due_ns {
                    self.note_lost(missing, shot.number);
                }
                if self.keep(shot, time_ns) {
                    let next_ns = due_ns + every_ns;
                    // One that came late is no reason to hurry afterwards.
                    let due_ns = Some(if next_ns > time_ns { next_ns } else { time_ns + every_ns });
                    self.requested = Requested::Every { every_ns, due_ns };
                }
            }
            _ => {}
        }
    }

    /// The middle of a picture's exposure, and when its shutter opened at the earliest, ns. A picture is read out after its exposure, which takes until the next
    /// has arrived at most; an exposure that is not known lasts as long at most.
    fn exposed(&self, stamp: Stamp, now_ns: u64) -> (u64, u64) {
        let half_ns = self.exposure_ns.unwrap_or(0) / 2;
        let time_ns = match stamp {
            Stamp::Opened(opened_ns) => opened_ns + half_ns,
            Stamp::Arrived(arrived_ns) => arrived_ns.saturating_sub(half_ns),
            Stamp::Unknown => now_ns.saturating_sub(half_ns),
        };
        let opened_ns = match (stamp, self.exposure_ns) {
            (Stamp::Opened(opened_ns), _) => opened_ns,
            (_, Some(_)) => self.last.map_or(0, |(_, last_ns)| last_ns.saturating_sub(half_ns)),
            (_, None) => self.before_last_ns,
        };
        (time_ns, opened_ns)
    }

    /// Keeps a picture, if it is one.
    fn keep(&mut self, shot: &Shot<'_>, time_ns: u64) -> bool {
        if shot.damaged {
            self.damaged += 1;
            if self.damaged > MOST_DAMAGED {
                self.note(PluginError::Failed(format!(
                    "{MOST_DAMAGED} pictures one after the other came damaged: look at the camera's cable and what else is on its bus"
                )));
            }
            return false;
        }
        let Layout { width, height, format, .. } = self.layout;
        let Some(pixels) = self.layout.grey(shot.bytes) else {
            self.note(PluginError::Failed(format!(
                "picture {} has {} bytes; {width} x {height} pixels in {} have {}: it is left out",
                shot.number,
                shot.bytes.len(),
                format.name(),
                self.layout.picture_bytes()
            )));
            return false;
        };
        if (self.kept.len() + 1) * pixels.len() > MOST_KEPT_BYTES {
            self.note(PluginError::InputLost(format!(
                "{} pictures wait and nobody has fetched them: there is no room for more; make shorter scans, or with greater steps",
                self.kept.len()
            )));
            return false;
        }
        self.damaged = 0;
        self.kept.push_back(Picture { time_ns, pixels });
        true
    }

    fn note_lost(&mut self, missing: u32, number: u32) {
        let (count, were) = if missing == 1 { ("1 picture", "was") } else { ("several pictures", "were") };
        let first = number.wrapping_sub(missing);
        self.note(PluginError::InputLost(format!(
            "{count} from number {first} to {} {were} lost between camera and computer: look at its cable, or take fewer or smaller pictures",
            number.wrapping_sub(1)
        )));
    }

    /// The first trouble is the one that is reported.
    fn note(&mut self, trouble: PluginError) {
        self.trouble.get_or_insert(trouble);
    }
}
