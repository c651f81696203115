#pragma once
// What every program of ours does with its standard streams before it does anything else.

namespace morphbus {

/// Makes stdin, stdout and stderr safe to use, whatever the parent left there; first thing in main.
///
/// A stream that is closed gets /dev/null opened in the wrong direction: its number can then not
/// become that of a file of ours, into which error messages would be written, and reading or
/// writing fails as it does on a closed stream. SIGPIPE and SIGXFSZ are ignored: writing to a pipe
/// without a reader, or beyond the limit of a file's size, fails with EPIPE or EFBIG, and the code
/// that writes decides what follows.
void PrepareStandardStreams();

/// Gives a child the signals back that PrepareStandardStreams ignores, since exec keeps them so;
/// for use between fork and exec.
void RestoreIgnoredSignals();

}  // namespace morphbus
