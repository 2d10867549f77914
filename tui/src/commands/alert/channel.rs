//! The ways to reach people.

use std::path::Path;

use super::mail::{Mail, MailError};
use super::trouble::Trouble;
use super::webhook::{Webhook, WebhookError};

/// Whether a message that did not arrive may arrive later.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delivery {
    /// It was refused for good.
    Refused,
    /// The network, or a server that is busy.
    MayPass,
}

/// Why a message did not arrive.
#[derive(Debug, thiserror::Error)]
pub(super) enum ChannelError {
    #[error(transparent)]
    Webhook(#[from] WebhookError),
    #[error(transparent)]
    Mail(#[from] MailError),
}

impl ChannelError {
    /// Whether it may arrive later.
    pub(super) fn delivery(&self) -> Delivery {
        match self {
            Self::Webhook(error) if !error.may_pass() => Delivery::Refused,
            _ => Delivery::MayPass,
        }
    }
}

/// One way to reach people.
pub(super) enum Channel {
    Webhook(Webhook),
    Mail(Mail),
}

impl Channel {
    pub(super) fn webhook(address: &str) -> Result<Self, WebhookError> {
        Webhook::at(address).map(Self::Webhook)
    }

    pub(super) fn mail(sendmail: &Path, to: &[String]) -> Result<Self, MailError> {
        Mail::to(sendmail, to).map(Self::Mail)
    }

    /// Its name in the list of what was reported: no two channels share one, and no secret is in it.
    pub(super) fn key(&self) -> &str {
        match self {
            Self::Webhook(webhook) => webhook.key(),
            Self::Mail(mail) => mail.name(),
        }
    }

    /// Its name for people, without what is secret in it.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Webhook(webhook) => webhook.name(),
            Self::Mail(mail) => mail.name(),
        }
    }

    pub(super) fn send(&self, trouble: &Trouble) -> Result<(), ChannelError> {
        match self {
            Self::Webhook(webhook) => webhook.send(trouble)?,
            Self::Mail(mail) => mail.send(trouble)?,
        }
        Ok(())
    }
}
