#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Comments of the headers as Doxygen wants them: a comment of its own says what follows it, one behind a
# declaration says what stands before it. The first comment of a file is about the file.
exec awk '
  /SPDX-License-Identifier/ { print ""; next }
  /^#ifdef HAPSIX_/ { print "#if 1"; next }  # what another header adds
  # A comment with its own line, in C and in C++.
  /^[ \t]*\/\*/ && !/^[ \t]*\/\*\*/ {
    sub(/\/\*/, first++ ? "/**" : "/** @file\n")
    # A line between sections is a comment about nothing.
    if ($0 ~ /-----/) { sub(/\/\*\*.*/, ""); }
  }
  /^[ \t]*\/\/ / { sub(/\/\/ /, first++ ? "/// " : "/// @file\n/// ") }
  /^[ \t]*\/\/$/ { sub(/\/\//, "///") }
  # A comment behind something.
  /[;,{}a-zA-Z0-9)][ \t]*\/\* / && !/^[ \t]*\/\*/ && !/typedef struct .*\{[^;]*\/\*.*$/ { sub(/\/\* /, "/**< ") }
  { gsub(/</, "\\<"); gsub(/\/\*\*\\</, "/**<"); gsub(/#include \\</, "#include <"); gsub(/template \\</, "template <")
    gsub(/1u \\<\\</, "1u <<"); print }
' "$1"
