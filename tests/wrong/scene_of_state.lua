-- expect: 7: links[1].mass: depends on the motion, a number or an expression of parameters is needed
local rd = require "refdyn"
local f = function(s) return s.t end
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = rd.input("load", 1, "kg") },
  },
}
