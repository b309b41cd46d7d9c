-- expect: 8: rd.sni: unknown function; did you mean "sin"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = rd.sni(s.t) } end,
}
