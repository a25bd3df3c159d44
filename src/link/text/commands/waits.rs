//! Waiting for a state that no command of its own ends with: homed, end of block, idle.
//!
//! A state is known from GetStatusRobot. It is asked for once at the beginning and again whenever the
//! robot tells that something has changed; with SetCtrlPortMonitoring(1) it tells by itself. A robot that
//! tells nothing (SetEob(0), no monitoring) is asked by the connection's own care after a quarter of its
//! limit of silence.

use core::future::Future;
use core::pin::{Pin, pin};
use core::task::{Context, Poll};

use crate::link::clock::MonotonicClock;
use crate::link::text::answer::Checkpoint;
use crate::link::text::client::Client;
use crate::link::text::error::AnswerError;
use crate::link::text::message::{Messages, OwnedMessage};
use crate::time::{Duration, Instant};
use crate::wire::meca500::code::Code;
use crate::wire::meca500::text::value::RobotStatus;

/// The checkpoint behind what [`Client::until_idle`] waits for.
///
/// Source: choice of the last one that the manual allows; a number may be used many times.
const IDLE_CHECKPOINT: u16 = 8_000;

/// News after which the state may be another.
const CHANGES: [Code; 10] = [
    Code::MOTORS_ACTIVATED,
    Code::HOMING_DONE,
    Code::MOTORS_DEACTIVATED,
    Code::ERROR_RESET,
    Code::MOTION_PAUSED,
    Code::MOTION_RESUMED,
    Code::MOTION_CLEARED,
    Code::END_OF_MOVEMENT,
    Code::END_OF_BLOCK,
    Code::END_OF_OFFLINE_PROGRAM,
];

/// Waits for a state of the robot.
#[must_use = "nobody waits yet"]
#[derive(Debug)]
pub struct StatusWait<'a, F = fn(&RobotStatus) -> bool> {
    client: &'a Client,
    messages: Messages,
    is_reached: F,
    /// Errors after which the state will not come.
    fails_with: &'static [Code],
}

impl<F: Fn(&RobotStatus) -> bool> StatusWait<'_, F> {
    /// Waits at most for `limit`; may be called again when that is over.
    ///
    /// # Errors
    ///
    /// [`AnswerError`].
    pub fn wait(&mut self, limit: Duration) -> Result<RobotStatus, AnswerError> {
        let clock = MonotonicClock::new();
        loop {
            let left = limit.saturating_sub(clock.now().saturating_duration_since(Instant::ZERO));
            match self.messages.wait_next(left) {
                Ok(Some(message)) => {
                    if let Some(result) = self.look_at(&message) {
                        return result;
                    }
                }
                Ok(None) => return Err(AnswerError::TimedOut),
                Err(reason) => return Err(AnswerError::Ended(reason)),
            }
        }
    }

    fn look_at(&self, message: &OwnedMessage) -> Option<Result<RobotStatus, AnswerError>> {
        let code = message.code;
        if code == Code::STATUS_ROBOT {
            let unreadable =
                |error| AnswerError::Unreadable { text: std::format!("{message}"), error };
            return match RobotStatus::read(&message.as_message()) {
                Ok(status) => (self.is_reached)(&status).then_some(Ok(status)),
                Err(error) => Some(Err(unreadable(error))),
            };
        }
        if self.fails_with.contains(&code) {
            return Some(Err(AnswerError::Refused { code, text: message.body.clone() }));
        }
        if CHANGES.contains(&code) {
            return self.client.ask_for_status().err().map(Err);
        }
        None
    }
}

impl<F: Fn(&RobotStatus) -> bool + Unpin> Future for StatusWait<'_, F> {
    type Output = Result<RobotStatus, AnswerError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        loop {
            match pin!(self.messages.next()).poll(context) {
                Poll::Ready(Ok(message)) => {
                    if let Some(result) = self.look_at(&message) {
                        return Poll::Ready(result);
                    }
                }
                Poll::Ready(Err(reason)) => return Poll::Ready(Err(AnswerError::Ended(reason))),
                Poll::Pending => return Poll::Pending,
            }
        }
    }
}

/// Waits until everything sent so far is executed and the robot stands still.
#[must_use = "nobody waits yet"]
#[derive(Debug)]
pub struct Idle<'a> {
    client: &'a Client,
    /// `None` when it is reached.
    checkpoint: Option<Checkpoint>,
    standstill: Option<StatusWait<'a>>,
}

impl<'a> Idle<'a> {
    /// Waits at most for `limit`; may be called again when that is over.
    ///
    /// # Errors
    ///
    /// [`AnswerError::Discarded`] when motion was cleared or the robot stopped for an error; the others
    /// as for any command.
    pub fn wait(&mut self, limit: Duration) -> Result<RobotStatus, AnswerError> {
        let clock = MonotonicClock::new();
        if let Some(checkpoint) = &mut self.checkpoint {
            checkpoint.wait(limit)?;
            self.checkpoint = None;
        }
        let left = limit.saturating_sub(clock.now().saturating_duration_since(Instant::ZERO));
        self.standstill()?.wait(left)
    }

    fn standstill(&mut self) -> Result<&mut StatusWait<'a>, AnswerError> {
        let standstill = match self.standstill.take() {
            Some(standstill) => standstill,
            None => self.client.until_end_of_block()?,
        };
        Ok(self.standstill.insert(standstill))
    }
}

impl Future for Idle<'_> {
    type Output = Result<RobotStatus, AnswerError>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        if let Some(checkpoint) = &mut self.checkpoint {
            match Pin::new(checkpoint).poll(context) {
                Poll::Ready(Ok(())) => self.checkpoint = None,
                Poll::Ready(Err(error)) => return Poll::Ready(Err(error)),
                Poll::Pending => return Poll::Pending,
            }
        }
        match self.standstill() {
            Ok(standstill) => Pin::new(standstill).poll(context),
            Err(error) => Poll::Ready(Err(error)),
        }
    }
}

impl Client {
    /// The answer comes as a message as any other.
    fn ask_for_status(&self) -> Result<(), AnswerError> {
        self.send("GetStatusRobot").map(drop)
    }

    fn until_status_or<F: Fn(&RobotStatus) -> bool>(
        &self,
        is_reached: F,
        fails_with: &'static [Code],
    ) -> Result<StatusWait<'_, F>, AnswerError> {
        let messages = self.messages();
        self.ask_for_status()?;
        Ok(StatusWait { client: self, messages, is_reached, fails_with })
    }

    /// Waits until the robot's status is as wanted. It is asked for, unlike with
    /// [`until`](Self::until) and [`wait_until`](Self::wait_until), which take what the robot tells by
    /// itself.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send); so everywhere below.
    pub fn until_status<F: Fn(&RobotStatus) -> bool>(
        &self,
        is_reached: F,
    ) -> Result<StatusWait<'_, F>, AnswerError> {
        self.until_status_or(is_reached, &[])
    }

    /// Waits until the robot is homed, whoever homes it. A homing that fails ends it.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn until_homed(&self) -> Result<StatusWait<'_>, AnswerError> {
        self.until_status_or(
            |status| status.is_homed,
            &[Code::HOMING_FAILED, Code::HOMING_OUTSIDE_LIMITS],
        )
    }

    /// Waits until the robot stands still with nothing in its queue. Between two commands that is so too:
    /// to wait for what was sent there is [`until_idle`](Self::until_idle). Source: PM L1937, L2490.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn until_end_of_block(&self) -> Result<StatusWait<'_>, AnswerError> {
        self.until_status_or(|status| status.is_end_of_block && status.is_end_of_motion, &[])
    }

    /// Waits until everything sent so far is executed and the robot stands still. A robot that is not ready
    /// for motion refuses it. It uses checkpoint 8000.
    ///
    /// # Errors
    ///
    /// As [`send`](Self::send).
    pub fn until_idle(&self) -> Result<Idle<'_>, AnswerError> {
        let checkpoint = Some(self.checkpoint(IDLE_CHECKPOINT)?);
        Ok(Idle { client: self, checkpoint, standstill: None })
    }
}
