"""How the bars above the rows of the timeline are drawn: when picks and holds act."""

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter

from palette4d.plotting import style
from palette4d.studio import paint
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session
from palette4d.studio.timeline_places import GUTTER, RULER, Places


def paint_lanes(painter: QPainter, session: Session, places: Places) -> None:
    """Draw the ranges of picks and holds: the fades as wedges, the frame as a diamond.

    Small boxes are the frames where the user has placed a window.
    """
    picks = places.lanes()
    if not picks:
        return
    painter.save()
    painter.setClipRect(QRectF(GUTTER, RULER + places.strip, places.width - GUTTER, places.upper))
    for pick, lane in picks:
        y, half = places.lane_y(lane), places.lane_height / 2 - 1
        begin, start, until, end = (places.x_of(t) for t in places.reach(pick))
        start, until = max(start, begin + 0.5), max(until, start + 1)
        shape = np.array(
            [
                (begin, y),
                (start, y - half),
                (until, y - half),
                (end, y),
                (until, y + half),
                (start, y + half),
            ]
        )
        chosen = pick.id in session.selection
        rim = paint.pen(style.BRIGHT if chosen else style.RING, 1.8 if chosen else 0.9)
        colour = on_screen(session, pick.rgb if pick.to is None else pick.to)
        painter.setBrush(paint.colour_of(colour))
        if not pick.enabled:
            rim.setDashPattern([3, 3])
            painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(rim)
        painter.drawPolygon(paint.polygon(shape))
        if pick.kind == "hold":  # a hold has a bar along it
            for grey, width in ((style.INK, 3.4), (style.BRIGHT, 1.4)):
                painter.setPen(paint.pen(grey, width))
                painter.drawLine(QPointF(start + 4, y), QPointF(until - 4, y))
        painter.setPen(paint.pen(style.INK, 1.2))
        painter.setBrush(QColor(style.BRIGHT))
        for key in () if pick.window is None else pick.window.given.keys:
            tall = min(3.0, half)
            painter.drawRect(QRectF(places.x_of(key.frame) - 2, y - tall, 4, 2 * tall))
        x = places.x_of(pick.frame)
        wide = min(5.0, half + 1)
        diamond = np.array([(x - wide, y), (x, y - wide), (x + wide, y), (x, y + wide)])
        painter.drawPolygon(paint.polygon(diamond))
    painter.restore()
