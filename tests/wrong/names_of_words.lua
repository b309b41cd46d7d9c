-- expect: 14: option requires: a reserved word of C or C++; choose another name
-- expect: 15: parameter nullptr: a reserved word of C or C++; choose another name
-- expect: 15: parameter constexpr: a reserved word of C or C++; choose another name
-- expect: 15: parameter alignas: a reserved word of C or C++; choose another name
-- expect: 15: parameter xor: a reserved word of C or C++; choose another name
-- expect: 15: parameter concept: a reserved word of C or C++; choose another name
-- expect: 15: parameter "_reserved": not an identifier of C; use a letter, then letters, digits and _
-- expect: 16: input typeof_unqual: a reserved word of C or C++; choose another name
-- expect: 20: link typeof: a reserved word of C or C++; choose another name
-- expect: 21: link asm: a reserved word of C or C++; choose another name
-- expect: 23: point char8_t: a reserved word of C or C++; choose another name
-- expect: 23: point co_await: a reserved word of C or C++; choose another name
local rd = require "refdyn"
rd.option("requires", 1)
rd.parameters { { "nullptr", 1 }, { "constexpr", 1 }, { "alignas", 1 }, { "xor", 1 }, { "concept", 1 }, { "_reserved", 1 } }
rd.input("typeof_unqual")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "typeof", joint = "z", mass = 1 },
    { "asm", joint = "z", mass = 1 },
  },
  points = { co_await = "asm", char8_t = "asm" },
}
