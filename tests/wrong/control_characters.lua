-- expect: 9: unit of m: contains control character 10, a line of text is needed
-- expect: 10: unit of F: contains control character 9, a line of text is needed
-- expect: 13: name of link: contains control character 13, a line of text is needed
-- expect: 14: name of point: contains control character 127, a line of text is needed
-- Names and units stand in lines: of messages, of motions, of comments in C.
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
