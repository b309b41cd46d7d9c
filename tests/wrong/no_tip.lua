-- expect: 8: links[2].on: "a" is not a beam; only a beam has a tip
-- expect: 9: links[3].on: "a.end" is not a place; did you mean "a.tip", the end of a beam?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
    { "b", on = "a.tip", mass = 1 },
    { "c", on = "a.end", mass = 1 },
  },
}
