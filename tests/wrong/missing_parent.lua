-- expect: 7: links[1].on: no link "bas"; did you mean "base"?
-- expect: 9: links[3].on: no link "nowhere"; use one of a, base, c
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", on = "bas", joint = { "x" }, mass = 1 },
    { "base", joint = { "y" }, mass = 1 },
    { "c", on = "nowhere", mass = 1 },
  },
}
