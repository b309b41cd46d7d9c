-- expect: 10: text "k\ng": contains control character 10; remove it
-- expect: 11: text "N\x09": contains control character 9; remove it
-- expect: 14: text "a\x0Db": contains control character 13; remove it
-- expect: 15: name "E\x7F": contains control character 127; remove it
-- expect: 15: text "a\x0Db": contains control character 13; remove it
-- Names and units appear in single lines: in messages, motions and comments of C.
local rd = require "refdyn"
local p
local function declare()
  p = rd.parameters { { "m", 1, "k\ng" } }
  return rd.input("F", 0, "N\t")
end
declare()
return rd.model { name = "wrong", links = { { "a\rb", joint = "x", mass = p.m } },
  points = { ["E\127"] = "a\rb" },
}
