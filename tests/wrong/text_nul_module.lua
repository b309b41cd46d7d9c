-- expect: 3: name "sin\x00x": contains control character 0; remove it
local rd = require "refdyn"
local x = rd["sin\0x"](1)
