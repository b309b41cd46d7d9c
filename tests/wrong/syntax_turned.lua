-- expect: 3: unexpected symbol near '<\226>'
local rd = require "refdyn"
local x = ‮ 2
