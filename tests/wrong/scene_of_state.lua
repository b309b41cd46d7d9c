-- expect: 7: links[1].mass: depends on the motion; must be a number or an expression in parameters
local rd = require "refdyn"
local f = function(s) return s.t end
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = rd.input("load", 1, "kg") },
  },
}
