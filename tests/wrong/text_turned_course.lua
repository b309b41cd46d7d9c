-- expect: 7: name "c\u{200F}": contains U+200F, which turns the direction of reading; remove it
-- expect: 7: name "d\u{61C}": contains U+061C, which turns the direction of reading; remove it
-- expect: 7: name "e\u{2069}": contains U+2069, which turns the direction of reading; remove it
-- expect: 7: name "f\u{200E}": contains U+200E, which turns the direction of reading; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  courses = function(s) return { ["c\u{200F}"] = s.q.a_x, ["d\u{61C}"] = 1, ["e\u{2069}"] = 2, ["f\u{200E}"] = 3 } end }
