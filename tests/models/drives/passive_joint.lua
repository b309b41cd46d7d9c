-- Seifried and Blajer 2013: two equal links, the second joint has a spring and a damper
local rd = require "refdyn"
local p = rd.parameters { { "T", 1.5, "s" }, { "share", 0.5 }, {"c", 50}, {"d", 0.25}, { "center", 0.5, "m" } }
return rd.model {
  name = "passive", gravity = { 0, 0, 0 },
  links = {
    { "a", joint = "psi", mass = 1, center = {0.5,0,0}, inertia = { zz = 1/12 } },
    { "b", on = "a", at = {1,0,0}, joint = "psi", mass = 1, center = { p.center, 0, 0 }, inertia = { zz = 1/12 }, spring = { psi = p.c }, damper = { psi = p.d } },
  },
  points = { E = { on = "b", at = { 1, 0, 0 } } },
  drives = { "a_psi" },
  constraints = function(s)
    return { rd.position { s.q.a_psi + p.share * s.q.b_psi - rd.pi/2 * rd.smoothstep(s.t, 0, p.T, 9) } }
  end,
}
