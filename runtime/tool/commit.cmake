# Writes the commit of SOURCE as a C text into OUTPUT, unless it is there already: from git, with a plus if files have
# changed since, or from commit.txt, into which `git archive` writes it; an empty text if neither knows it.
cmake_minimum_required(VERSION 3.25)
set(commit)
if(EXISTS ${SOURCE}/.git)
    execute_process(COMMAND git -C ${SOURCE} rev-parse HEAD OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    execute_process(COMMAND git -C ${SOURCE} diff-index --quiet HEAD -- RESULT_VARIABLE is_changed ERROR_QUIET)
else()
    file(STRINGS ${SOURCE}/runtime/tool/commit.txt commit)
endif()
if(NOT commit MATCHES "^[0-9a-f]+$")
    set(commit)
endif()
string(SUBSTRING "${commit}" 0 12 commit)
if(commit AND is_changed)
    string(APPEND commit "+")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT "/* The commit of the sources. */
extern const char tool_commit[];

const char tool_commit[] = \"@commit@\";
")
