local rd = require "refdyn"
return rd.model { name = "arm", gravity = {0,0,-9.81}, links = {
 { "arm", joint = "theta", start = { theta = -0.3 }, beam = { length = 1.2, section = rd.rectangle(0.03, 0.006), E = 7e10, nu = 0.33, rho = 2700, eta = 1e-4, rfe = 8 } } },
 points = { tip = "arm.tip" }, 
 constraints = function(s) return { rd.contact { 0.5 - s.q.arm_theta, restitution = 0.4, name = "stop" }, rd.contact { s.points.tip.z + 0.5, restitution = 0.2, name = "floor" } } end }
